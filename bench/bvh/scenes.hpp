#pragma once
#include "soup.hpp"
#include <lambent/scene/camera.hpp>
#include <functional>
#include <string>
#include <vector>

/// What rays are shot at, and from where.
struct BenchScene {
    Soup soup;
    lambent::Camera camera;
};

/// A scene's file or builtin:cornell, seen by its first camera or one that frames it. throws lambent::Error
BenchScene load_bench_scene(const std::string& name);

/// A file of triangles, framed. throws lambent::Error
BenchScene soup_scene(const std::string& path);

/// A closed sphere with bumps, of about `faces` triangles: what a bench has without any file.
BenchScene blob(int faces);

/// `strands` curls that grow from a ball, each a square tube of 24 segments: 192 triangles, all long and thin.
BenchScene hair(int strands);

/// Crytek Sponza, Sibenik and hotel_room from below `folder`, and hair; the blob where the folder has none of
/// them. Each is made when its function is called.
std::vector<std::function<BenchScene()>> default_scenes(const std::string& folder, int strands);
