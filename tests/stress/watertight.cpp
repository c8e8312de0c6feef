// Rays in any number at edges and vertices of closed meshes, each by one query: every one must hit.
//   watertight [--rays N] [--seed S]
// Prints a table by tree and one by place, what own_edges makes of double hits, what a plain triangle test misses of
// such rays, and a line of the stress suite's table. Last line "N rays, M misses". Status 1 if there are misses, or if
// with own_edges a ray leaves a closed mesh an even number of times, or if the plain test misses nothing. Where
// denormals are flushed to zero (-ffast-math), edges are not owned at 2^-50 (see facing.hpp): nothing is counted there.
// tests/stress.sh runs it under many flags.
#include "support/aimed_rays.hpp"
#include "support/random.hpp"
#include <lambent/bvh/compact.hpp>
#include <lambent/bvh/facing.hpp>
#include <lambent/bvh/for_each_hit.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

using namespace lambent;
using namespace lambent_test;

namespace {

constexpr std::size_t block = 256; // rays of one query
constexpr int queries = 4;
constexpr const char* query_names[queries] = {"closest", "any", "batch closest", "batch any"};

struct Counts {
    std::size_t rays[queries] = {}, misses[queries] = {};
    std::size_t counted = 0, doubles = 0, owned_doubles = 0, owned_even = 0; // by for_each_hit

    void operator+=(const Counts& c) {
        for (int q = 0; q < queries; ++q) {
            rays[q] += c.rays[q];
            misses[q] += c.misses[q];
        }
        counted += c.counted;
        doubles += c.doubles;
        owned_doubles += c.owned_doubles;
        owned_even += c.owned_even;
    }
    std::size_t all_rays() const { return rays[0] + rays[1] + rays[2] + rays[3]; }
    std::size_t all_misses() const { return misses[0] + misses[1] + misses[2] + misses[3]; }
    std::size_t failures() const { return all_misses() + owned_even; }
};

template <class T>
struct Block {
    std::array<Ray<T>, block> rays;
    std::array<Hit<T>, block> hits;
    std::array<bool, block> occluded;
};

/// Every other eight blocks are aimed at neighbours from nearly one point, so that batches go in packets.
template <class T>
void aim(const Placed<T>& placed, std::size_t number, Random& random, Block<T>& b) {
    const std::size_t faces = placed.mesh.faces.size(), first = random.index(faces);
    const bool together = number / 8 % 2 == 1;
    const Vec3<double> origin = random.in_box<double>(-0.4, 0.4);
    for (std::size_t i = 0; i < block;) {
        if (together) {
            const std::size_t face = (first + random.index(24)) % faces;
            const Vec3<double> near = glm::clamp(origin + random.in_box<double>(-0.01, 0.01), -0.4, 0.4);
            b.rays[i] = aimed_ray(placed, random.index(3), face, int(random.index(3)), near, random);
        } else {
            b.rays[i] = aimed_ray(placed, i, random);
        }
        if (b.rays[i].direction != Vec3<T>(0)) ++i;
    }
}

template <class T>
void tell(const Ray<T>& ray, const char* query) { // enough to fire it again
    static int told = 0;
    if (++told > 20) return;
    const Vec3<double> o(ray.origin), d(ray.direction);
    std::fprintf(stderr, "miss (%s): origin %a %a %a direction %a %a %a\n", query, o.x, o.y, o.z, d.x, d.y, d.z);
}

/// How often a ray meets two triangles at one t, and whether with own_edges it leaves the mesh an odd number of times.
template <class Tree, class T>
void count_doubles(const Tree& tree, const Ray<T>& ray, Counts& counts) {
    const auto meets = [&](const auto& filter, std::size_t& hits) {
        std::array<T, 64> depths;
        hits = 0;
        for_each_hit(tree, ray, filter, [&](const Hit<T>& hit) {
            if (hits < depths.size()) depths[hits] = hit.t;
            ++hits;
        });
        const auto end = depths.begin() + std::ptrdiff_t(std::min(hits, depths.size()));
        std::sort(depths.begin(), end);
        return std::adjacent_find(depths.begin(), end) != end;
    };
    std::size_t all = 0, owned = 0;
    ++counts.counted;
    counts.doubles += std::size_t(meets(AcceptAll{}, all));
    counts.owned_doubles += std::size_t(meets(own_edges, owned));
    const bool even = owned % 2 == 0;
    counts.owned_even += std::size_t(even);
    if (even) tell(ray, "own_edges, an even number of hits");
}

/// Own edges rest on products that may be denormal.
template <class T>
bool denormals_count() {
    volatile T x = std::numeric_limits<T>::min();
    return T(x) * T(0.5) > 0;
}

template <class T, class Tree>
Counts shoot(const Tree& tree, const Placed<T>& placed, std::size_t rays, Random& random) {
    Counts counts;
    const bool owned = placed.scale >= T(0x1p-40) || denormals_count<T>();
    const auto b = std::make_unique<Block<T>>();
    const std::size_t first = random.index(16), end = first + (rays + block - 1) / block;
    for (std::size_t number = first; number < end; ++number) {
        aim(placed, number, random, *b);
        const std::size_t query = number % queries;
        const std::span<const Ray<T>> batch(b->rays);
        const std::span<bool> occluded(b->occluded);
        if (query == 0)
            for (std::size_t i = 0; i < block; ++i) b->hits[i] = tree.intersect(b->rays[i]);
        if (query == 1)
            for (std::size_t i = 0; i < block; ++i) b->occluded[i] = tree.occluded(b->rays[i]);
        if (query == 2) tree.intersect(batch, std::span<Hit<T>>(b->hits));
        if (query == 3) tree.occluded(batch, occluded);
        if (query % 2 == 0)
            for (std::size_t i = 0; i < block; ++i) b->occluded[i] = bool(b->hits[i]);
        const auto met = std::size_t(std::count(occluded.begin(), occluded.end(), true));
        counts.rays[query] += block;
        counts.misses[query] += block - met;
        if (met != block)
            for (std::size_t i = 0; i < block; ++i)
                if (!b->occluded[i]) tell(b->rays[i], query_names[query]);
        for (std::size_t i = number % 128; owned && i < block; i += 128) count_doubles(tree, b->rays[i], counts);
    }
    return counts;
}

// The trees
enum class Layout { full, compact };

struct Variant {
    const char* name;
    bool is_double;
    Layout layout;
    BuildQuality quality;
    int share; // of 100 rays
};
constexpr Variant variants[] = {
    {"float, fast", false, Layout::full, BuildQuality::fast, 20},
    {"float, balanced", false, Layout::full, BuildQuality::balanced, 30},
    {"float, best", false, Layout::full, BuildQuality::best, 30},
    {"float, compact", false, Layout::compact, BuildQuality::balanced, 5},
    {"double, fast", true, Layout::full, BuildQuality::fast, 5},
    {"double, best", true, Layout::full, BuildQuality::best, 10},
};
constexpr double offsets[] = {0, 1, 1e3, 1e5}; // in sizes: the meshes' is 2
constexpr double scales[] = {1, 0x1p-50, 0x1p50};

template <class T>
std::vector<lambent_test::Mesh<T>> shapes(std::uint64_t seed) {
    return {sphere<T>(80, 40, 0.5, seed), sphere<T>(7, 5, 0, seed), cube<T>(16), sphere<T>(160, 100, 0.5, seed + 1),
            with_needles(sphere<T>(40, 20, 0.5, seed + 2), seed)};
}

template <class T>
Counts shoot(const Variant& variant, const Placed<T>& placed, std::size_t rays, Random& random) {
    const auto set = triangles(placed.mesh.vertices, placed.mesh.faces);
    const BuildOptions options{.quality = variant.quality};
    if (variant.layout == Layout::compact)
        return shoot(CompactBvh<std::remove_const_t<decltype(set)>>::build(set, options), placed, rays, random);
    return shoot(BasicBvh<T>::build(set, options), placed, rays, random);
}

/// The plain test, as it stands in many books.
/// source  Moeller, Trumbore, "Fast, minimum storage ray-triangle intersection", 1997
bool moeller_trumbore(const Rayf& ray, const std::array<Vec3f, 3>& v) {
    const Vec3f e1 = v[1] - v[0], e2 = v[2] - v[0], p = cross(ray.direction, e2);
    const float determinant = dot(e1, p);
    if (determinant == 0) return false;
    const Vec3f s = ray.origin - v[0], q = cross(s, e1);
    const float inverse = 1 / determinant, u = dot(s, p) * inverse, w = dot(ray.direction, q) * inverse;
    return (u >= 0) & (w >= 0) & (u + w <= 1) & (dot(e2, q) * inverse >= 0);
}

/// Rays that the plain test lets through a mesh of 56 triangles, each of which is asked.
std::size_t plain_misses(std::size_t rays, Random& random) {
    const Placed<float> placed(sphere<float>(7, 5, 0, 1), 0, 1);
    std::vector<std::array<Vec3f, 3>> faces;
    for (std::size_t i = 0; i < placed.mesh.faces.size(); ++i) faces.push_back(placed.mesh.triangle(i));
    std::size_t misses = 0;
    for (std::size_t i = 0; i < rays; ++i) {
        const Rayf ray = aimed_ray(placed, i, random);
        misses += std::size_t(
            std::none_of(faces.begin(), faces.end(), [&](const auto& face) { return moeller_trumbore(ray, face); }));
    }
    return misses;
}

void print(const char* name, const Counts& c) {
    std::printf("%-18s %12zu %9zu %9zu %13zu %9zu %11zu %11zu %11zu %11zu\n", name, c.all_rays(), c.misses[0],
                c.misses[1], c.misses[2], c.misses[3], c.counted, c.doubles, c.owned_doubles, c.owned_even);
}

void print_head(const char* name) {
    std::printf("%-18s %12s %9s %9s %13s %9s %11s %11s %11s %11s\n", name, "rays", "closest", "any", "batch closest",
                "batch any", "counted", "doubles", "owned twice", "owned even");
}

template <class T>
void run(const Variant& variant, double rays, std::uint64_t seed, Random& random, Counts& by_variant,
         Counts (&by_place)[std::size(offsets)][std::size(scales)]) {
    const auto meshes = shapes<T>(seed);
    const double places = double(meshes.size() * std::size(offsets) * std::size(scales));
    for (const auto& mesh : meshes)
        for (std::size_t o = 0; o < std::size(offsets); ++o)
            for (std::size_t s = 0; s < std::size(scales); ++s) {
                const Placed<T> placed(mesh, 2 * offsets[o], scales[s]);
                const Counts counts = shoot(variant, placed, std::size_t(std::ceil(rays / places)), random);
                by_variant += counts;
                by_place[o][s] += counts;
            }
}

} // namespace

int main(int argc, char** argv) {
    double rays = 1e7;
    std::uint64_t seed = 1;
    for (int i = 1; i < argc; i += 2) {
        const std::string_view option = argv[i];
        const bool valued = i + 1 < argc;
        if (option == "--rays" && valued && std::atof(argv[i + 1]) >= 1)
            rays = std::atof(argv[i + 1]);
        else if (option == "--seed" && valued)
            seed = std::strtoull(argv[i + 1], nullptr, 10);
        else
            return std::fprintf(stderr, "usage: watertight [--rays N] [--seed S]\n"), 2;
    }
    Random random(seed);
    Counts total, by_place[std::size(offsets)][std::size(scales)];
    std::printf("Lanes of a node: %d (float), %d (double). Misses by query; of the counted rays those that meet two\n"
                "triangles at one t, that do with own_edges, and that then have an even number of hits.\n",
                node_width<float>, node_width<double>);
    print_head("tree");
    for (const Variant& variant : variants) {
        Counts counts;
        const double part = rays * variant.share / 100;
        if (variant.is_double)
            run<double>(variant, part, seed, random, counts, by_place);
        else
            run<float>(variant, part, seed, random, counts, by_place);
        print(variant.name, counts);
        std::fflush(stdout);
        total += counts;
    }
    print_head("offset, scale");
    for (std::size_t o = 0; o < std::size(offsets); ++o)
        for (std::size_t s = 0; s < std::size(scales); ++s) {
            char name[32];
            std::snprintf(name, sizeof name, "%g, 2^%d", offsets[o], std::ilogb(scales[s]));
            print(name, by_place[o][s]);
        }
    print("all", total);
    const auto plain_rays = std::size_t(std::clamp(rays / 10, 1e5, 2e6));
    const std::size_t plain = plain_misses(plain_rays, random);
    std::printf("Moeller and Trumbore's test misses %zu of %zu such rays: %.1f of a million\n", plain, plain_rays,
                1e6 * double(plain) / double(plain_rays));
    std::printf("STRESS %-13s | %-88s | %9.3g | %8zu | %9.2e | %8.1e | %9.2e\n", "rays",
                "rays at edges and vertices -> share that gets through; naive: Moeller and Trumbore",
                double(total.all_rays()), total.failures(), double(total.all_misses()) / double(total.all_rays()), 0.0,
                double(plain) / double(plain_rays));
    if (plain == 0) std::printf("FAILED: these rays find no cracks\n");
    std::printf("%zu rays, %zu misses\n", total.all_rays(), total.all_misses());
    return total.failures() > 0 || plain == 0 ? 1 : 0;
}
