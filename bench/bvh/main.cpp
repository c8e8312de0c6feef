// Rays a second through our tree, beside Embree where it was found: one thread, interleaved, medians of CPU time.
#include "../../examples/support/command_line.hpp"
#include "input.hpp"
#include "rays.hpp"
#include <lambent/bvh/statistics.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#if defined(LAMBENT_BENCH_EMBREE)
#include "embree.hpp"
#endif

namespace {

using namespace lambent;

struct Options {
    std::vector<std::string> scenes, soups, ray_files, classes = {"primary", "ao", "bounce", "bounce2", "shadow"};
    int rounds = 7, side = 512;
    bool json = false, in_double = false;
    std::optional<Vec3d> eye, target;
    std::optional<double> vertical_fov;
};

/// What a library answers: t of the nearest hit, or any finite number for some hit; infinity for none.
using Answer = std::function<void(const RayClass&, std::vector<float>&)>;

struct Contender {
    std::string library, variant;
    double build_s = 0, bytes_per_triangle = 0;
    Answer answer;
    std::vector<double> seconds{};
    std::vector<float> t{};
};

double cpu_seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

constexpr float infinity = std::numeric_limits<float>::infinity();

template <class T>
std::vector<Vec3<T>> vertices_of(const Soup& soup) {
    return std::vector<Vec3<T>>(soup.vertices.begin(), soup.vertices.end());
}

template <class T>
Ray<T> converted(const Rayf& r) {
    return {Vec3<T>(r.origin), Vec3<T>(r.direction), T(r.t_min), T(r.t_max)};
}

template <class T>
void answer_with(const BasicBvh<T>& bvh, const RayClass& rays, std::vector<float>& t) {
    for (std::size_t i = 0; i < rays.rays.size(); ++i) {
        const Ray<T> ray = converted<T>(rays.rays[i]);
        if (rays.any) {
            t[i] = bvh.occluded(ray) ? 0 : infinity;
        } else {
            const Hit<T> hit = bvh.intersect(ray);
            t[i] = hit ? float(hit.t) : infinity;
        }
    }
}

template <class T>
Contender our_tree(const Soup& soup, const std::vector<Vec3<T>>& vertices, BasicBvh<T>& bvh) {
    const double start = cpu_seconds();
    bvh = BasicBvh<T>::build(triangles(vertices, soup.faces));
    const double build_s = cpu_seconds() - start;
    return {"lambent", std::is_same_v<T, double> ? "double" : "float", build_s, statistics(bvh).bytes_per_triangle(),
            [&bvh](const RayClass& rays, std::vector<float>& t) { answer_with(bvh, rays, t); }};
}

/// How many answers are not the double tree's: a hit for a miss, or a distance that is off by more than 1e-4
/// of itself and of the scene.
std::size_t count_wrong(const std::vector<float>& t, const std::vector<float>& reference, double diagonal) {
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < t.size(); ++i) {
        const bool hit = t[i] < infinity, should = reference[i] < infinity;
        wrong += std::size_t(hit != should ||
                             (hit && std::abs(double(t[i]) - reference[i]) > 1e-4 * (double(reference[i]) + diagonal)));
    }
    return wrong;
}

double median(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
    return values[values.size() / 2];
}

void report(const Options& o, const Soup& soup, const RayClass& rays, const Contender& c, double embree_s,
            std::size_t wrong) {
    const double seconds = median(c.seconds), rate = double(rays.rays.size()) / seconds * 1e-6;
    const std::string ratio = embree_s > 0 ? std::to_string(embree_s / seconds) : o.json ? "null" : "-";
    if (o.json)
        std::printf("{\"bench\":\"bvh\",\"scene\":\"%s\",\"triangles\":%zu,\"class\":\"%s\",\"rays\":%zu,\"library\":\"%s\","
                    "\"variant\":\"%s\",\"batch\":false,\"build_s\":%.4f,\"bytes_per_triangle\":%.1f,"
                    "\"mrays_per_s\":%.4f,\"ratio_to_embree\":%s,\"wrong\":%zu}\n",
                    soup.name.c_str(), soup.faces.size(), rays.name.c_str(), rays.rays.size(), c.library.c_str(),
                    c.variant.c_str(), c.build_s, c.bytes_per_triangle, rate, ratio.c_str(), wrong);
    else
        std::printf("%-24s %-10s %-8s %-8s %8.3f Mrays/s %10s of embree, %zu of %zu wrong\n", soup.name.c_str(),
                    rays.name.c_str(), c.library.c_str(), c.variant.c_str(), rate, ratio.c_str(), wrong,
                    rays.rays.size());
    std::fflush(stdout);
}

void run(const Options& o, const Soup& soup, Camera camera) {
    BasicBvh<float> tree;
    BasicBvh<double> double_tree;
    const std::vector<Vec3d> double_vertices = vertices_of<double>(soup);
    std::vector<Contender> contenders;
    contenders.push_back(our_tree(soup, soup.vertices, tree));
    Contender reference = our_tree(soup, double_vertices, double_tree);
    if (o.in_double) contenders.push_back(reference);
#if defined(LAMBENT_BENCH_EMBREE)
    const double start = cpu_seconds();
    const EmbreeScene embree(soup);
    contenders.push_back({"embree", "high", cpu_seconds() - start, 0, [&embree](const RayClass& rays, std::vector<float>& t) {
                              for (std::size_t i = 0; i < rays.rays.size(); ++i)
                                  t[i] = !rays.any                          ? embree.intersect(rays.rays[i])
                                         : embree.occluded(rays.rays[i]) ? 0.0f
                                                                          : infinity;
                          }});
#endif
    if (tree.empty()) fail(soup.name + ": there are no triangles to shoot at");
    if (o.eye) camera.eye = *o.eye - soup.origin;
    if (o.target) camera.target = *o.target - soup.origin;
    if (o.vertical_fov) camera.vertical_fov = *o.vertical_fov;
    RayMaker maker(soup, tree, camera, o.side);
    std::vector<RayClass> classes;
    for (const std::string& name : o.classes) classes.push_back(maker.make(name));
    for (const std::string& file : o.ray_files) classes.push_back(read_rays(file));
    const double diagonal = double(length(tree.bounds().max - tree.bounds().min));

    for (const RayClass& rays : classes) {
        if (rays.rays.empty()) continue;
        reference.t.assign(rays.rays.size(), infinity);
        reference.answer(rays, reference.t);
        for (Contender& c : contenders) {
            c.seconds.clear();
            c.t.assign(rays.rays.size(), infinity);
            c.answer(rays, c.t); // warm
        }
        for (int round = 0; round < o.rounds; ++round)
            for (Contender& c : contenders) {
                const double begin = cpu_seconds();
                c.answer(rays, c.t);
                c.seconds.push_back(std::max(cpu_seconds() - begin, 1e-6));
            }
        double embree_s = 0;
        for (const Contender& c : contenders)
            if (c.library == "embree") embree_s = median(c.seconds);
        for (const Contender& c : contenders) report(o, soup, rays, c, embree_s, count_wrong(c.t, reference.t, diagonal));
    }
}

/// A bumpy sphere from outside, and the insides of two buildings where their files are.
void run_defaults(const Options& o) {
    Camera camera;
    camera.eye = {0, 0.5, 3};
    camera.target = {0, 0, 0};
    run(o, blob_soup(100000), camera);

    const auto run_file = [&](const std::string& file, const Vec3d& eye, const Vec3d& target, double vertical_fov) {
        const std::string path = LAMBENT_SHARED_DIR "/scenes/" + file;
        if (!std::filesystem::exists(path)) return;
        Soup soup = scene_soup(path, camera);
        soup.name = file;
        camera.eye = eye - soup.origin;
        camera.target = target - soup.origin;
        camera.vertical_fov = vertical_fov;
        run(o, soup, camera);
    };
    run_file("sponza_crytek/sponza.glb", {-5, 2, 0}, {5, 2.5, 0}, 70);
    run_file("sibenik/sibenik.obj", {-18, -15, -0.1}, {-17, -14.75, -0.1}, 53.13);
}

Options parse(int argc, char** argv) {
    Options o;
    CommandLine line("bench_bvh [SCENE...] [options]    .gltf .glb .obj builtin:cornell; none = a bumpy sphere, and Sponza and Sibenik where found");
    line.add("--soup F", "triangles as uint32 count, then nine float32 each", [&](const auto& v) { o.soups.push_back(v); });
    line.add("--rays F", "rays from a file, besides the classes", [&](const auto& v) { o.ray_files.push_back(v); });
    line.add("--classes LIST", "of primary,ao,bounce,bounce2,shadow, or none",
             [&](const auto& v) { o.classes = v == "none" ? std::vector<std::string>() : split(v, ','); });
    line.add("--size N", "rays of the camera a side, a multiple of 8 [512]", [&](const auto& v) { o.side = int(to_integer(v, 8, 8192)) / 8 * 8; });
    line.add("--rounds N", "of which the median counts [7]", [&](const auto& v) { o.rounds = int(to_integer(v, 1, 1000)); });
    line.add("--batch", "rays by the batch (not yet: exits with 2)",
             [](const auto&) { throw UsageError("there are no queries for batches of rays yet"); });
    line.add("--double", "the tree in double as well", [&](const auto&) { o.in_double = true; });
    const auto point = [](const std::string& v) {
        const std::vector<double> p = to_numbers(v, 3);
        return Vec3d(p[0], p[1], p[2]);
    };
    line.add("--eye X,Y,Z", "camera", [&](const auto& v) { o.eye = point(v); });
    line.add("--target X,Y,Z", "camera", [&](const auto& v) { o.target = point(v); });
    line.add("--vfov DEG", "camera", [&](const auto& v) { o.vertical_fov = to_positive(v); });
    line.add("--json", "one object a line", [&](const auto&) { o.json = true; });
    line.add("--quick", "fewer rays and rounds", [&](const auto&) { o.side = 128, o.rounds = 3; });
    line.add("--help", "this", [&](const auto&) { line.print_help(), std::exit(0); });
    o.scenes = line.parse(argc, argv);
    for (const std::string& name : o.classes)
        if (name != "primary" && name != "ao" && name != "bounce" && name != "bounce2" && name != "shadow")
            throw UsageError("--classes: there is no '" + name + "'");
    return o;
}

} // namespace

int main(int argc, char** argv) {
    try {
        const Options o = parse(argc, argv);
        for (const std::string& file : o.soups) {
            const Soup soup = read_soup(file);
            Bounds3<double> box;
            for (const Vec3f& v : soup.vertices)
                if (is_finite(v)) box.add(Vec3d(v));
            run(o, soup, framing_camera(box, 1));
        }
        for (const std::string& name : o.scenes) {
            Camera camera;
            const Soup soup = scene_soup(name, camera);
            run(o, soup, camera);
        }
        if (o.scenes.empty() && o.soups.empty()) run_defaults(o);
        return 0;
    } catch (const UsageError& e) {
        std::fprintf(stderr, "bench_bvh: %s\n", e.what());
        return 2;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_bvh: %s\n", e.what());
        return 1;
    }
}
