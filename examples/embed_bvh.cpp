// Our tree inside a ray tracer such as you may have: its vectors, its vertices, its rays and its pool of threads stay
// its own. It draws a pyramid that floats over a floor and its shadow, in letters.
#include <lambent/bvh/bvh.hpp>
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

// types: begin
namespace mine { // what a renderer brings along
struct Point {
    double x, y, z;
};
struct Vertex {
    Point position;
    float texture[2];
};
struct Face {
    std::uint16_t corner[3];
    std::uint16_t operator[](std::size_t i) const { return corner[i]; }
};
struct Segment {
    Point from, to;
};
struct Pool { // runs job(0) ... job(count - 1) on its threads
    template <class Job> void run(int count, const Job& job) const {
        std::vector<std::thread> threads;
        for (int i = 0; i < count; ++i) threads.emplace_back([&job, i] { job(i); });
        for (std::thread& t : threads) t.join();
    }
};
} // namespace mine

// How lambent sees it: a function to a vector, one to a ray, and an executor.
lambent::Vec3f vec(const mine::Point& p) { return lambent::Vec3f(float(p.x), float(p.y), float(p.z)); }
lambent::Rayf ray(const mine::Segment& s) { return {.origin = vec(s.from), .direction = vec(s.to) - vec(s.from), .t_max = 1}; }
struct OnPool {
    const mine::Pool& pool;
    unsigned concurrency() const { return 2; }
    template <class F> void parallel_for(std::size_t n, std::size_t grain, const F& f) {
        const std::size_t ranges = (n + grain - 1) / grain; // a range is [i grain, i grain + grain), on any thread
        pool.run(2, [&](int t) {
            for (std::size_t i = std::size_t(t); i < ranges; i += 2) f(i * grain, std::min(n, i * grain + grain));
        });
    }
};
// types: end

int main() {
    const std::vector<mine::Vertex> vertices = {{{-9, 0, -9}, {}}, {{9, 0, -9}, {}}, {{9, 0, 9}, {}}, {{-9, 0, 9}, {}},
                                                {{-1, 1, -1}, {}}, {{1, 1, -1}, {}}, {{1, 1, 1}, {}}, {{-1, 1, 1}, {}},
                                                {{0, 2.5, 0}, {}}};
    const std::vector<mine::Face> faces = {{{0, 2, 1}}, {{0, 3, 2}}, {{4, 5, 6}}, {{4, 6, 7}},
                                           {{4, 8, 5}}, {{5, 8, 6}}, {{6, 8, 7}}, {{7, 8, 4}}};
    // build: begin
    const auto mesh = lambent::triangles(vertices, faces, [](const mine::Vertex& v) { return vec(v.position); });
    const mine::Pool pool;
    OnPool executor{pool};
    const lambent::Bvh bvh = lambent::Bvh::build(mesh, {.quality = lambent::BuildQuality::best}, executor);
    // build: end
    const mine::Point eye{0, 3, 9}, lamp{-4, 6, 3};
    for (int row = 0; row < 20; ++row) {
        std::string line;
        for (int column = 0; column < 64; ++column) {
            const mine::Segment seen{eye, {(column - 31.3) / 4, (9.6 - row) / 2, -4}};
            // query: begin
            const lambent::Hit<float> hit = bvh.intersect(seen, ray);
            // query: end
            const double t = 0.9999 * double(hit.t); // a renderer that moves its origins its own way
            const auto at = [&](double a, double b) { return a + t * (b - a); };
            const mine::Point p{at(eye.x, seen.to.x), at(eye.y, seen.to.y), at(eye.z, seen.to.z)};
            line += !hit ? ' ' : hit.primitive >= 4 ? '#' : bvh.occluded(mine::Segment{p, lamp}, ray) ? '.' : '-';
        }
        std::puts(line.c_str());
    }
}
