// Rays a second and triangles built a second of our trees, beside Embree: see --help.
#include "../../examples/support/command_line.hpp"
#include "affinity.hpp"
#include "lambent_trees.hpp"
#include "measure.hpp"
#include "rays.hpp"
#include "scenes.hpp"
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <thread>

namespace {

using namespace lambent;

const std::vector<std::string> all_classes = {"build", "primary", "ao", "shadow", "bounce", "bounce2"};

struct Options {
    std::vector<std::string> scenes, soups, ray_files, classes = all_classes;
    int rounds = 7, side = 512, strands = 6000;
    unsigned threads = 1; ///< of a second run, if more than 1
    std::optional<int> processor;
    Format format = Format::table;
    LambentModes modes;
    std::string embree = "libembree3.so.3", embree4, write_folder;
    std::optional<Vec3d> eye, target;
    std::optional<double> vertical_fov;
};

const char* const explanation = R"(
Scenes: Crytek Sponza, Sibenik and hotel_room where the shared scenes are, and hair: 6000 curled square tubes made
here, 1 152 000 thin triangles. Without shared scenes a bumpy sphere stands for the three.

Classes
  build      millions of triangles a second on one thread, in at most 3 rounds: lambent fast, balanced, best; Embree
             low (Morton), medium, high. fast is compared with medium, best with high. Bytes a triangle are what rays
             read (lambent), or what Embree holds after the build by its own count, the caller's buffers left out.
  primary    camera rays in tiles of 8 x 8
  ao         cosine-weighted from what the camera sees, 5 % of the scene's diagonal long; any hit
  shadow     from there to a square light under the scene's top; any hit
  bounce     cosine-weighted from there, no end; closest hit
  bounce2    the same from what those hit
  or the name of a file of rays

Contenders, in turn in one process, each round
  lambent float           one ray a call, the tree as users get it by default; float-best: with spatial splits
  lambent float batch     --batch: all rays in one call
  lambent compact, double --compact, --double
  embree high             Embree 3, one ray a call, build quality high, not robust: its fastest
  embree4 high            --embree4: the same in Embree 4
  ... high-packets8, 16   --batch: packets, from the same array of rays; flagged coherent for primary

Figures: rays or triangles over the median of the rounds' times, in CPU time where one thread runs (--threads adds a
run with more, by the clock on the wall). A ratio to Embree is the median over the rounds of the ratio of both
times in that round, to Embree's "high" ray by ray with as many threads. At the end come geometric means of the
ratios over the scenes, with the worst scene; in JSON as scene "geomean".
wrong: answers unlike those of our tree in double: hit for miss or miss for hit, or a distance off by more than 1e-4
of itself and of the scene's diagonal. differing: hit for miss or miss for hit, or another triangle, also where two
meet or coincide.

Embree 3 is loaded from the system (Debian: libembree3-3). Embree 4, from the Python package that carries it:
  pip download --no-deps embreex && unzip embreex-*.whl 'embreex.libs/*'
  bench_bvh --embree4 embreex.libs/libembree4-*.so.4

Files, little endian
  soup  uint32 count, then nine float32 a triangle
  rays  uint32 magic 0x53594152 ('RAYS'), uint32 kind (0 closest hit, 1 any hit), uint32 count, uint32 0, then eight
        float32 a ray: origin, t_min, direction (of unit length), t_max (may be infinite)
)";

/// Of 'a/b/scene.glb' a name for files: 'scene'.
std::string file_stem(const std::string& name) { return std::filesystem::path(name).stem().string(); }

std::vector<EmbreeLibrary> load_embrees(const Options& o) {
    std::vector<EmbreeLibrary> libraries;
    try {
        libraries.emplace_back(o.embree, 3);
    } catch (const lambent::Error& e) {
        std::fprintf(stderr, "bench_bvh: no ratios to Embree 3: %s\n", e.what());
    }
    if (!o.embree4.empty()) libraries.emplace_back(o.embree4, 4);
    return libraries;
}

std::vector<RayClass> make_classes(const Options& o, const BenchScene& scene, const Bvh& tree) {
    RayMaker maker(scene.soup, tree, scene.camera, o.side);
    std::vector<RayClass> classes;
    for (const std::string& name : o.classes)
        if (name != "build") classes.push_back(maker.make(name));
    for (const std::string& file : o.ray_files) classes.push_back(read_rays(file));
    std::erase_if(classes, [](const RayClass& c) { return c.rays.empty(); });
    return classes;
}

void write_files(const Options& o, const BenchScene& scene) {
    const Bvh tree = Bvh::build(triangles(scene.soup.vertices, scene.soup.faces));
    const std::string base = o.write_folder + "/" + file_stem(scene.soup.name);
    write_soup(base + ".tri", scene.soup);
    for (const RayClass& rays : make_classes(o, scene, tree)) {
        const std::string path = base + "_" + file_stem(rays.name) + ".rays";
        write_rays(path, rays);
        std::printf("%s: %zu rays\n", path.c_str(), rays.rays.size());
    }
}

void run(const Options& o, const std::vector<EmbreeLibrary>& libraries, const BenchScene& scene, Printer& printer) {
    const auto print = [&](std::vector<Result> results) {
        for (Result& r : results) {
            r.scene = scene.soup.name;
            r.triangles = scene.soup.faces.size();
            printer.add(r);
        }
    };
    std::vector<RayClass> classes;
    std::vector<Contender> contenders;
    std::optional<LambentTrees> ours;
    double diagonal = 0;
    {
        const Pinned pinned(o.processor);
        if (std::find(o.classes.begin(), o.classes.end(), "build") != o.classes.end())
            print(measure_builds(scene.soup, libraries, std::min(o.rounds, 3)));
        ours = lambent_trees(scene.soup, o.modes);
        contenders = ours->contenders;
        for (const EmbreeLibrary& library : libraries)
            for (const Contender& c : embree_contenders(library, scene.soup, o.modes.batch)) contenders.push_back(c);
        classes = make_classes(o, scene, *ours->tree);
        diagonal = double(length(ours->tree->bounds().max - ours->tree->bounds().min));
        for (const RayClass& rays : classes)
            print(measure_rays(rays, contenders, ours->reference, diagonal, {o.rounds, 1}));
    }
    if (o.threads > 1)
        for (const RayClass& rays : classes)
            print(measure_rays(rays, contenders, ours->reference, diagonal, {o.rounds, o.threads}));
}

Options parse(int argc, char** argv) {
    Options o;
    const auto point = [](const std::string& v) {
        const std::vector<double> p = to_numbers(v, 3);
        return Vec3d(p[0], p[1], p[2]);
    };
    CommandLine line("bench_bvh [SCENE...] [options]    .gltf, .glb, .obj or builtin:cornell; none: those below");
    line.add("--soup F", "triangles from a file", [&](const auto& v) { o.soups.push_back(v); });
    line.add("--rays F", "rays from a file, besides the classes", [&](const auto& v) { o.ray_files.push_back(v); });
    line.add("--classes LIST", "of build,primary,ao,shadow,bounce,bounce2, or none [all]",
             [&](const auto& v) { o.classes = v == "none" ? std::vector<std::string>() : split(v, ','); });
    line.add("--size N", "rays of the camera a side, a multiple of 8 [512]",
             [&](const auto& v) { o.side = int(to_integer(v, 8, 8192)) / 8 * 8; });
    line.add("--rounds N", "of which the median counts [7]",
             [&](const auto& v) { o.rounds = int(to_integer(v, 1, 1000)); });
    line.add("--batch", "rays by the batch and in Embree's packets as well",
             [&](const auto&) { o.modes.batch = true; });
    line.add("--double", "the tree in double as well", [&](const auto&) { o.modes.in_double = true; });
    line.add("--compact", "the tree that reads the caller's vertices as well",
             [&](const auto&) { o.modes.compact = true; });
    line.add("--threads N|all", "then rays once more on so many threads [1]", [&](const auto& v) {
        o.threads = v == "all" ? std::max(1u, std::thread::hardware_concurrency()) : unsigned(to_integer(v, 1, 4096));
    });
    line.add("--pin N", "one thread runs on processor N",
             [&](const auto& v) { o.processor = int(to_integer(v, 0, 1023)); });
    line.add("--embree PATH", "library of Embree 3 [libembree3.so.3]", [&](const auto& v) { o.embree = v; });
    line.add("--embree4 PATH", "library of Embree 4 [none]", [&](const auto& v) { o.embree4 = v; });
    line.add("--eye X,Y,Z", "camera", [&](const auto& v) { o.eye = point(v); });
    line.add("--target X,Y,Z", "camera", [&](const auto& v) { o.target = point(v); });
    line.add("--vfov DEG", "camera", [&](const auto& v) { o.vertical_fov = to_positive(v); });
    line.add("--write-rays DIR", "writes SCENE.tri and SCENE_CLASS.rays there, and measures nothing",
             [&](const auto& v) { o.write_folder = v; });
    line.add("--json", "one object a line", [&](const auto&) { o.format = Format::json; });
    line.add("--quick", "fewer rays, rounds and hairs",
             [&](const auto&) { o.side = 128, o.rounds = 3, o.strands = 500; });
    line.add("--help", "this", [&](const auto&) { line.print_help(), std::fputs(explanation, stdout), std::exit(0); });
    o.scenes = line.parse(argc, argv);
    for (const std::string& name : o.classes)
        if (std::find(all_classes.begin(), all_classes.end(), name) == all_classes.end())
            throw UsageError("--classes: there is no '" + name + "'");
    return o;
}

std::vector<std::function<BenchScene()>> chosen_scenes(const Options& o) {
    if (o.scenes.empty() && o.soups.empty()) return default_scenes(LAMBENT_SHARED_DIR "/scenes", o.strands);
    std::vector<std::function<BenchScene()>> scenes;
    for (const std::string& file : o.soups) scenes.push_back([file] { return soup_scene(file); });
    for (const std::string& name : o.scenes) scenes.push_back([name] { return load_bench_scene(name); });
    return scenes;
}

int bench(const Options& o) {
    Printer printer(o.format);
    std::vector<EmbreeLibrary> libraries;
    if (o.write_folder.empty()) libraries = load_embrees(o);
    for (const auto& make : chosen_scenes(o)) {
        BenchScene scene = make();
        if (scene.soup.faces.empty()) fail(scene.soup.name + ": there are no triangles to shoot at");
        if (o.eye) scene.camera.eye = *o.eye - scene.soup.origin;
        if (o.target) scene.camera.target = *o.target - scene.soup.origin;
        if (o.vertical_fov) scene.camera.vertical_fov = *o.vertical_fov;
        if (o.write_folder.empty()) {
            run(o, libraries, scene, printer);
        } else {
            write_files(o, scene);
        }
    }
    printer.finish();
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    try {
        return bench(parse(argc, argv));
    } catch (const UsageError& e) {
        std::fprintf(stderr, "bench_bvh: %s\n", e.what());
        return 2;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "bench_bvh: %s\n", e.what());
        return 1;
    }
}
