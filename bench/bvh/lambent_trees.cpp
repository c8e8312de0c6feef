#include "lambent_trees.hpp"
#include <lambent/bvh/compact.hpp>
#include <lambent/bvh/statistics.hpp>
#include <cstdint>
#include <span>
#include <type_traits>

using namespace lambent;

namespace {

template <class Tree>
struct Built {
    Tree tree;
    double seconds = 0;
};

template <class Tree, class Set>
std::shared_ptr<const Built<Tree>> build(const Set& set, BuildQuality quality = BuildOptions{}.quality) {
    BuildOptions options;
    options.quality = quality;
    const double start = cpu_seconds();
    Tree tree = Tree::build(set, options);
    const double seconds = cpu_seconds() - start;
    return std::make_shared<const Built<Tree>>(Built<Tree>{std::move(tree), seconds});
}

template <class T>
Ray<T> converted(const Rayf& r) {
    return {Vec3<T>(r.origin), Vec3<T>(r.direction), T(r.t_min), T(r.t_max)};
}

template <class T>
void store(const Hit<T>& hit, std::size_t i, Answers& answers) {
    answers.t[i] = hit ? float(hit.t) : no_hit;
    answers.primitive[i] = hit.primitive;
}

template <class Tree>
Contender single_rays(std::shared_ptr<const Built<Tree>> built, const std::string& variant) {
    Contender c;
    c.library = "lambent";
    c.variant = variant;
    c.build_s = built->seconds;
    c.bytes_per_triangle = statistics(built->tree).bytes_per_triangle();
    c.trace = [built](const RayClass& rays, std::size_t begin, std::size_t end, Answers& answers) {
        using T = typename Tree::Scalar;
        const Tree& tree = built->tree;
        if (rays.any) {
            for (std::size_t i = begin; i < end; ++i)
                answers.t[i] = tree.occluded(converted<T>(rays.rays[i])) ? 0 : no_hit;
        } else {
            for (std::size_t i = begin; i < end; ++i)
                store(tree.intersect(converted<T>(rays.rays[i])), i, answers);
        }
    };
    return c;
}

/// Batches write hits and flags of the library's own, as a user gets them.
struct BatchResults {
    std::vector<Hit<float>> hits;
    std::unique_ptr<bool[]> flags; // no vector: that of bool has no bools
};

template <class Tree>
Contender batches(std::shared_ptr<const Built<Tree>> built, const std::string& variant) {
    Contender c = single_rays(built, variant);
    c.batch = true;
    const auto results = std::make_shared<BatchResults>();
    c.prepare = [results](const RayClass& rays) {
        results->hits.resize(rays.rays.size());
        results->flags = std::make_unique<bool[]>(rays.rays.size());
    };
    c.trace = [built, results](const RayClass& rays, std::size_t begin, std::size_t end, Answers&) {
        const std::span<const Rayf> part(rays.rays.data() + begin, end - begin);
        if (rays.any) {
            built->tree.occluded(part, std::span<bool>(results->flags.get() + begin, part.size()));
        } else {
            built->tree.intersect(part, std::span<Hit<float>>(results->hits.data() + begin, part.size()));
        }
    };
    c.finish = [results](const RayClass& rays, Answers& answers) {
        for (std::size_t i = 0; i < rays.rays.size(); ++i) {
            if (rays.any) {
                answers.t[i] = results->flags[i] ? 0 : no_hit;
            } else {
                store(results->hits[i], i, answers);
            }
        }
    };
    return c;
}

/// Adds a float tree: ray by ray, and by the batch where it is asked to.
template <class Tree>
void enter(std::shared_ptr<const Built<Tree>> built, const std::string& variant, const LambentModes& modes,
           std::vector<Contender>& contenders) {
    contenders.push_back(single_rays(built, variant));
    if (modes.batch) contenders.push_back(batches(built, variant));
}

Contender double_tree(const Soup& soup) {
    const std::vector<Vec3d> vertices(soup.vertices.begin(), soup.vertices.end());
    return single_rays(build<BasicBvh<double>>(triangles(vertices, soup.faces)), "double");
}

} // namespace

BuildCost build_lambent(const Soup& soup, BuildQuality quality) {
    const auto built = build<Bvh>(triangles(soup.vertices, soup.faces), quality);
    return {built->seconds, statistics(built->tree).bytes_per_triangle()};
}

LambentTrees lambent_trees(const Soup& soup, const LambentModes& modes) {
    const auto mesh = triangles(soup.vertices, soup.faces);
    LambentTrees trees;
    const auto by_default = build<Bvh>(mesh);
    trees.tree = std::shared_ptr<const Bvh>(by_default, &by_default->tree);
    enter(by_default, "float", modes, trees.contenders);
    enter(build<Bvh>(mesh, BuildQuality::best), "float-best", modes, trees.contenders);
    using Compact = CompactBvh<std::remove_const_t<decltype(mesh)>>;
    if (modes.compact) enter(build<Compact>(mesh), "compact", modes, trees.contenders);
    trees.reference = double_tree(soup);
    if (modes.in_double) trees.contenders.push_back(trees.reference);
    return trees;
}
