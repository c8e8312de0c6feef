#pragma once
#include <cstddef>
#include <string>
#include <vector>

/// One line of what was measured. Ratios are 0 where there is nothing to compare with.
struct Result {
    std::string scene, ray_class, library, variant;
    bool batch = false;
    unsigned threads = 1;
    std::size_t triangles = 0, rays = 0; ///< rays: 0 in the class "build"
    double build_s = 0, bytes_per_triangle = 0;
    double rate = 0; ///< millions a second: of rays, or in the class "build" of triangles
    double ratio_to_embree = 0, ratio_to_embree4 = 0;
    std::size_t wrong = 0, differing = 0;
};

enum class Format { table, json };

/// Prints results as they come, and at the end what they are over all scenes.
class Printer {
public:
    explicit Printer(Format format) : format_(format) {}
    void add(const Result& result);
    /// Geometric means over the scenes, and the scene with the lowest ratio; for each class and contender.
    void finish() const;

private:
    void print_summary_json() const;
    void print_summary_table(const std::string& peer, double Result::* ratio, bool builds) const;

    Format format_;
    std::vector<Result> results_;
};
