#include "results.hpp"
#include <algorithm>
#include <cmath>
#include <cstdio>

namespace {

std::string quoted(const std::string& text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') out += '\\';
        out += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
    return out + '"';
}

template <class... Values>
std::string format(const char* pattern, Values... values) {
    char text[256];
    std::snprintf(text, sizeof text, pattern, values...);
    return text;
}

std::string ratio_or(const char* none, double ratio) { return ratio > 0 ? format("%.4f", ratio) : none; }

std::string name_of(const Result& r) {
    return r.library + " " + r.variant + (r.batch ? " batch" : "") +
           (r.threads > 1 ? " x" + std::to_string(r.threads) : "");
}

/// A scene's name without the folders of its file.
std::string short_name(const std::string& scene) { return scene.substr(scene.find_last_of('/') + 1); }

template <class Key>
std::vector<std::string> distinct(const std::vector<Result>& results, Key key) {
    std::vector<std::string> found;
    for (const Result& r : results)
        if (const std::string k = key(r); std::find(found.begin(), found.end(), k) == found.end()) found.push_back(k);
    return found;
}

/// Of one class and contender over all scenes.
struct Summary {
    double mean = 0, worst = 0; ///< 0: there are no ratios
    std::string worst_scene;
    std::size_t scenes = 0, wrong = 0, differing = 0;
    const Result* any = nullptr;
};

Summary summarise(const std::vector<Result>& results, const std::string& ray_class, const std::string& name,
                  double Result::* ratio) {
    Summary s;
    double logarithms = 0;
    for (const Result& r : results) {
        if (r.ray_class != ray_class || name_of(r) != name) continue;
        s.any = &r;
        s.wrong += r.wrong;
        s.differing += r.differing;
        if (!(r.*ratio > 0)) continue;
        ++s.scenes;
        logarithms += std::log(r.*ratio);
        if (s.worst == 0 || r.*ratio < s.worst) s.worst = r.*ratio, s.worst_scene = r.scene;
    }
    if (s.scenes > 0) s.mean = std::exp(logarithms / double(s.scenes));
    return s;
}

std::string head_json(const Result& r, const std::string& scene) {
    return "{\"bench\":\"bvh\",\"scene\":" + quoted(scene) + ",\"class\":" + quoted(r.ray_class) +
           ",\"library\":" + quoted(r.library) + ",\"variant\":" + quoted(r.variant) +
           ",\"batch\":" + (r.batch ? "true" : "false") + ",\"threads\":" + std::to_string(r.threads);
}

std::string to_json(const Result& r) {
    std::string line = head_json(r, r.scene) + ",\"triangles\":" + std::to_string(r.triangles);
    line += format(",\"build_s\":%.4f,\"bytes_per_triangle\":%.1f", r.build_s, r.bytes_per_triangle);
    if (r.ray_class == "build") {
        line += format(",\"mtris_per_s\":%.4f", r.rate);
    } else {
        line += format(",\"rays\":%zu,\"mrays_per_s\":%.4f,\"wrong\":%zu,\"differing\":%zu", r.rays, r.rate, r.wrong,
                       r.differing);
    }
    return line + ",\"ratio_to_embree\":" + ratio_or("null", r.ratio_to_embree) +
           ",\"ratio_to_embree4\":" + ratio_or("null", r.ratio_to_embree4) + "}";
}

std::string to_text(const Result& r) {
    std::string line = format("%-12s %-8s %-30s", short_name(r.scene).c_str(), short_name(r.ray_class).c_str(),
                              name_of(r).c_str());
    line += format(" %9.3f %-8s", r.rate, r.ray_class == "build" ? "Mtri/s" : "Mrays/s");
    if (r.ratio_to_embree > 0) line += format(" %6.3f of embree", r.ratio_to_embree);
    if (r.ratio_to_embree4 > 0) line += format(" %6.3f of embree4", r.ratio_to_embree4);
    if (r.ray_class == "build") return line + format("   %.1f bytes a triangle", r.bytes_per_triangle);
    return line + format("   %zu wrong, %zu differing of %zu", r.wrong, r.differing, r.rays);
}

} // namespace

void Printer::add(const Result& result) {
    results_.push_back(result);
    std::printf("%s\n", (format_ == Format::json ? to_json(result) : to_text(result)).c_str());
    std::fflush(stdout);
}

void Printer::finish() const {
    if (format_ == Format::json) return print_summary_json();
    for (const bool builds : {true, false}) {
        print_summary_table("embree", &Result::ratio_to_embree, builds);
        print_summary_table("embree4", &Result::ratio_to_embree4, builds);
    }
}

void Printer::print_summary_json() const {
    for (const std::string& ray_class : distinct(results_, [](const Result& r) { return r.ray_class; }))
        for (const std::string& name : distinct(results_, name_of)) {
            const Summary s = summarise(results_, ray_class, name, &Result::ratio_to_embree),
                          s4 = summarise(results_, ray_class, name, &Result::ratio_to_embree4);
            if (s.any == nullptr || (s.scenes == 0 && s4.scenes == 0)) continue;
            std::string line = head_json(*s.any, "geomean");
            line += format(",\"scenes\":%zu,\"wrong\":%zu,\"differing\":%zu", std::max(s.scenes, s4.scenes), s.wrong,
                           s.differing);
            line += ",\"ratio_to_embree\":" + ratio_or("null", s.mean);
            line += ",\"ratio_to_embree4\":" + ratio_or("null", s4.mean);
            line += ",\"worst_ratio\":" + ratio_or("null", s.worst) +
                    ",\"worst_scene\":" + (s.scenes > 0 ? quoted(s.worst_scene) : "null");
            std::printf("%s}\n", line.c_str());
        }
}

void Printer::print_summary_table(const std::string& peer, double Result::* ratio, bool builds) const {
    std::vector<Result> results;
    for (const Result& r : results_)
        if ((r.ray_class == "build") == builds) results.push_back(r);
    if (std::none_of(results.begin(), results.end(), [&](const Result& r) { return r.*ratio > 0; })) return;

    const std::vector<std::string> classes = distinct(results, [](const Result& r) { return r.ray_class; });
    std::printf("\nRatio to %s: geometric mean over the scenes, and the worst of them\n%-32s", peer.c_str(), "");
    for (const std::string& ray_class : classes) std::printf("%-21s", short_name(ray_class).substr(0, 20).c_str());
    std::printf("%s\n", builds ? "" : "wrong");
    for (const std::string& name : distinct(results, name_of)) {
        std::string line = format("%-32s", name.c_str());
        std::size_t scenes = 0, wrong = 0;
        for (const std::string& ray_class : classes) {
            const Summary s = summarise(results, ray_class, name, ratio);
            scenes += s.scenes;
            wrong += s.wrong;
            const std::string worst = short_name(s.worst_scene).substr(0, 10);
            line += s.scenes > 0 ? format("%4.2f %4.2f %-11s", s.mean, s.worst, worst.c_str()) : format("%-21s", "-");
        }
        if (scenes == 0) continue;
        std::printf("%s%s\n", line.c_str(), builds ? "" : std::to_string(wrong).c_str());
    }
}
