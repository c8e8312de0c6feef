#include "pixel.hpp"
#include "job.hpp"
#include "path_printer.hpp"
#include "trace_with.hpp"
#include <lambent/sampling/independent.hpp>
#include <lambent/sampling/sobol.hpp>
#include <lambent/sampling/stratified.hpp>
#include <cstring>
#include <variant>

using namespace lambent;

namespace {

/// A sampler that is chosen at run time: nothing here is in a hurry, and integrators are compiled once for all.
class AnySampler {
    using Samplers = std::variant<SobolSampler<float>, StratifiedSampler<float>, IndependentSampler<float>>;

public:
    explicit AnySampler(const Options& o) : sampler_(make(o)) {}

    class Stream {
    public:
        using Scalar = float;
        float get_1d(std::uint32_t d) const {
            return std::visit([&](const auto& stream) { return stream.get_1d(d); }, stream_);
        }
        Vec2f get_2d(std::uint32_t d) const {
            return std::visit([&](const auto& stream) { return stream.get_2d(d); }, stream_);
        }

    private:
        friend AnySampler;
        template <class S>
        using StreamOf = decltype(std::declval<const S&>().at(0u, 0u, 0u));
        std::variant<StreamOf<SobolSampler<float>>, StreamOf<StratifiedSampler<float>>, StreamOf<IndependentSampler<float>>> stream_;
        template <class S>
        explicit Stream(const S& stream) : stream_(stream) {}
    };
    Stream at(std::uint32_t x, std::uint32_t y, std::uint32_t sample) const {
        return std::visit([&](const auto& sampler) { return Stream(sampler.at(x, y, sample)); }, sampler_);
    }

private:
    static Samplers make(const Options& o) {
        switch (o.sampler) {
        case SamplerKind::stratified: return stratified_sampler(o);
        case SamplerKind::independent: return IndependentSampler<float>(o.seed);
        case SamplerKind::sobol: break;
        }
        return SobolSampler<float>(o.seed);
    }
    Samplers sampler_;
};

/// An integrator whose samples are printed, with their paths where it follows some.
template <class I>
struct Printed {
    I integrator;
    PathPrinter& printer;
    std::uint64_t& next;
    double firefly_clamp;

    template <class S, class Stream>
    PixelSample<float> sample(const S& scene, const Rayf& ray, const Stream& stream, RayCounts& counts) const {
        printer.begin(next++, ray);
        PixelSample<float> sample = [&] {
            if constexpr (requires { integrator.sample(scene, ray, stream, counts, printer.listener()); })
                return integrator.sample(scene, ray, stream, counts, printer.listener());
            else return integrator.sample(scene, ray, stream, counts);
        }();
        PixelSample<float> kept = sample;
        clamp_reflected(kept, float(firefly_clamp));
        printer.end(kept.radiance);
        return sample;
    }
};

} // namespace

int show_pixel(const Options& o) {
    Job job(o);
    FilmState<float> state = empty_state(job);
    const auto [x, y] = std::pair(o.pixel->x, o.pixel->y);
    state.window = {x, y, x + 1, y + 1};
    RenderOptions options = render_options(o, state);
    options.first_sample = o.samples().begin;
    options.end_sample = o.samples().end;
    std::printf("pixel %d,%d of %d x %d, samples %s of %s\n", x, y, o.width, o.height, describe(o.samples()).c_str(),
                o.scene.c_str());

    PathPrinter printer(job.prepared);
    std::uint64_t next = options.first_sample;
    SerialExecutor serial;
    Film<float> shown;
    with_integrator(o, job.scene, [&](const auto& integrator) {
        const Printed<std::decay_t<decltype(integrator)>> printed{integrator, printer, next, o.firefly_clamp};
        render(shown, job.prepared, job.camera, printed, AnySampler(o), options, serial, [] { return true; });
    });
    tracer_of(o.sampler)(state.film = {}, job.prepared, job.camera, o, options, job.threads, [] { return true; });

    const Vec3f mean = shown.resolve().radiance.load(0, 0), image = state.film.resolve().radiance.load(0, 0);
    std::printf("\nmean of samples %s\nin the image    %s before denoising\n", PathPrinter::exact(mean).c_str(),
                PathPrinter::exact(image).c_str());
    if (std::memcmp(&mean, &image, sizeof mean) == 0) return 0;
    std::fprintf(stderr, "render: the compiler rounded the paths shown otherwise than those of the image\n");
    return 1;
}
