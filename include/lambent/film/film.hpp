#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/film/dyadic.hpp>
#include <lambent/film/film_planes.hpp>
#include <lambent/film/pixel_data.hpp>
#include <lambent/film/pixel_sample.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Accumulators of a frame. Samples are summed pairwise over aligned dyadic blocks of sample indices, so the
/// rounding error grows with log2 of their number and the sums depend on *which* samples are in, not on how
/// they were split between threads, passes, runs or machines: any split merges to the same bits.
/// The samples of one film need not be contiguous; no sample is in twice.
/// A pixel may stop at a power of two: then it holds those samples of the blocks that lie below it, and all its numbers
/// are to the bit those of a film of so many samples. It never goes on.
/// memory  width · height · (7 to 50 by the planes) · sizeof(T) for each block: one where their number is a power
///         of two, at most log2 of it for samples from 0 on; a byte a pixel where one has stopped
template <class T>
class Film {
public:
    /// log2 of the sample index at which a pixel stopped, or `goes_on`.
    using Stop = std::uint8_t;
    static constexpr Stop goes_on = 0xff;

    /// The sums of one block of samples, pixel by pixel.
    struct Block {
        DyadicBlock samples;
        std::vector<T> sums; ///< width · height · channels()
    };

    Film() = default;
    /// throws lambent::Error on an empty or negative size
    Film(int width, int height, FilmPlanes planes) : width_(width), height_(height), planes_(planes) {
        require(width > 0 && height > 0, [&] {
            return "Film: size " + std::to_string(width) + " x " + std::to_string(height) + " is not positive";
        });
        if (contains(planes, FilmPlanes::material)) material_.assign(pixel_count(), -1);
    }

    int width() const { return width_; }
    int height() const { return height_; }
    FilmPlanes planes() const { return planes_; }
    int channels() const { return layout().channels; }
    std::size_t pixel_count() const { return std::size_t(width_) * std::size_t(height_); }
    const std::vector<Block>& blocks() const { return blocks_; }             ///< ascending
    const std::vector<std::int32_t>& material() const { return material_; }  ///< of the first sample; -1 = miss
    std::uint64_t rejected() const { return rejected_; } ///< samples that were not finite, see make_finite()

    const std::vector<Stop>& stops() const { return stops_; } ///< a pixel each; empty where none has stopped

    /// Samples of a pixel that has not stopped.
    std::uint64_t sample_count() const {
        std::uint64_t n = 0;
        for (const Block& b : blocks_) n += b.samples.size();
        return n;
    }
    /// Samples of this pixel.
    std::uint64_t sample_count(std::size_t pixel) const {
        std::uint64_t n = 0;
        for (const Block& b : blocks_) n += held(b.samples, pixel);
        return n;
    }
    /// Samples of all pixels.
    std::uint64_t total_samples() const {
        if (stops_.empty()) return sample_count() * pixel_count();
        std::uint64_t n = 0;
        for (std::size_t pixel = 0; pixel < pixel_count(); ++pixel) n += sample_count(pixel);
        return n;
    }

    /// The samples that are in, at pixels that have not stopped, as few ranges as possible, ascending.
    std::vector<SampleRange> ranges() const {
        std::vector<SampleRange> out;
        for (const Block& b : blocks_) {
            if (!out.empty() && out.back().end == b.samples.first) out.back().end = b.samples.end();
            else out.push_back(b.samples.range());
        }
        return out;
    }

    /// The parts of `wanted` that are not in.
    std::vector<SampleRange> missing(SampleRange wanted) const {
        std::vector<SampleRange> out;
        for (const SampleRange& done : ranges()) {
            if (wanted.begin < std::min(done.begin, wanted.end))
                out.push_back({wanted.begin, std::min(done.begin, wanted.end)});
            wanted.begin = std::max(wanted.begin, done.end);
        }
        if (wanted.begin < wanted.end) out.push_back(wanted);
        return out;
    }

    /// Adds all samples of `other`; equal to having rendered them here.
    /// throws lambent::Error when sizes or planes differ, a sample is in both, or a pixel stopped in the one before
    ///         samples that it has in the other
    void merge(Film other) {
        require(width_ == other.width_ && height_ == other.height_ && planes_ == other.planes_, [&] {
            return "Film: cannot merge " + shape() + " with " + other.shape();
        });
        for (const Block& a : blocks_)
            for (const Block& b : other.blocks_)
                require(!a.samples.range().overlaps(b.samples.range()), [&] {
                    return "Film: samples " + describe(a.samples.range()) + " and " + describe(b.samples.range()) +
                           " overlap";
                });
        merge_stops(other);
        if (other.first_sample() < first_sample()) material_ = std::move(other.material_);
        rejected_ += other.rejected_;
        for (Block& b : other.blocks_) blocks_.push_back(std::move(b));
        std::sort(blocks_.begin(), blocks_.end(),
                  [](const Block& a, const Block& b) { return a.samples.first < b.samples.first; });
        join_halves();
    }

    /// Puts a film together again from what it was saved as.
    /// throws lambent::Error on wrong sizes, on blocks that overlap, are not aligned or not in order, and on stops that
    ///         are none
    static Film restore(int width, int height, FilmPlanes planes, std::vector<Block> blocks,
                        std::vector<std::int32_t> material, std::uint64_t rejected, std::vector<Stop> stops = {}) {
        Film film(width, height, planes);
        const std::size_t sums = film.pixel_count() * std::size_t(film.channels());
        for (Block& block : blocks) {
            const DyadicBlock s = block.samples;
            require(block.sums.size() == sums && s.level <= 32 && s.first % s.size() == 0 && s.end() > s.first &&
                        (film.blocks_.empty() || (film.blocks_.back().samples.end() <= s.first &&
                                                  !film.blocks_.back().samples.joins(s))),
                    [&] {
                        return "Film: block of 2^" + std::to_string(s.level) + " samples at " +
                               std::to_string(s.first) + " does not fit";
                    });
            film.blocks_.push_back(std::move(block));
        }
        require(material.size() == film.material_.size(), "Film: wrong number of material indices");
        film.material_ = std::move(material);
        film.rejected_ = rejected;
        require(stops.empty() || stops.size() == film.pixel_count(), "Film: wrong number of stops");
        for (const Stop stop : stops)
            require(stop < 32 || stop == goes_on, [&] { return "Film: a pixel stopped at 2^" + std::to_string(stop); });
        film.stops_ = std::move(stops);
        return film;
    }

    /// The means, as planes; those that the film has not are absent; a pixel without samples is 0. `position_offset` is
    /// added to positions (the scene's origin). All values are finite; sums that overflowed come as the largest number.
    PixelData<T> resolve(const Vec3d& position_offset = Vec3d(0)) const;

private:
    template <class U> friend class FilmPass;

    detail::FilmLayout layout() const { return detail::FilmLayout(planes_); }

    /// `material_` is this sample's.
    std::uint64_t first_sample() const {
        return blocks_.empty() ? std::numeric_limits<std::uint64_t>::max() : blocks_.front().samples.first;
    }

    /// The sample index before which a pixel's samples lie.
    std::uint64_t end_of(std::size_t pixel) const {
        if (stops_.empty() || stops_[pixel] == goes_on) return std::numeric_limits<std::uint64_t>::max();
        return std::uint64_t(1) << stops_[pixel];
    }
    /// How many of a block's samples a pixel holds. As stops are powers of two: none or all where the block isn't at 0.
    std::uint64_t held(const DyadicBlock& block, std::size_t pixel) const {
        return std::min(block.end(), std::max(block.first, end_of(pixel))) - block.first;
    }

    /// Takes the earlier of both stops, everywhere or, where that cannot be, nowhere.
    void merge_stops(const Film& other) {
        if (stops_.empty() && other.stops_.empty()) return;
        std::vector<Stop> stops(pixel_count(), goes_on);
        for (std::size_t pixel = 0; pixel < stops.size(); ++pixel) {
            const std::uint64_t a = end_of(pixel), b = other.end_of(pixel);
            for (const Block& block : (a < b ? other : *this).blocks_)
                require(block.samples.end() <= std::min(a, b) || block.samples.first >= std::max(a, b), [&] {
                    return "Film: pixel " + std::to_string(pixel) + " stopped at sample " +
                           std::to_string(std::min(a, b)) + " and has some of " + describe(block.samples.range());
                });
            stops[pixel] = a < b ? stops_[pixel] : b < a || !other.stops_.empty() ? other.stops_[pixel] : goes_on;
        }
        stops_ = std::move(stops);
    }

    void join_halves() {
        const detail::FilmLayout layout = this->layout();
        std::vector<Block> joined;
        for (Block& block : blocks_) {
            joined.push_back(std::move(block));
            while (joined.size() > 1 && joined[joined.size() - 2].samples.joins(joined.back().samples)) {
                Block& left = joined[joined.size() - 2];
                const double n = double(left.samples.size());
                for (std::size_t pixel = 0; pixel < pixel_count(); ++pixel) {
                    if (held(joined.back().samples, pixel) == 0) continue;
                    const std::size_t i = pixel * std::size_t(layout.channels);
                    layout.merge_halves(&left.sums[i], &joined.back().sums[i], n);
                }
                ++left.samples.level;
                joined.pop_back();
            }
        }
        blocks_ = std::move(joined);
    }

    std::string shape() const {
        return std::to_string(width_) + " x " + std::to_string(height_) + " pixels (planes: " + describe(planes_) + ")";
    }

    int width_ = 0, height_ = 0;
    FilmPlanes planes_ = FilmPlanes::features;
    std::vector<Block> blocks_;
    std::vector<std::int32_t> material_;
    std::vector<Stop> stops_;
    std::uint64_t rejected_ = 0;
};

template <class T>
PixelData<T> Film<T>::resolve(const Vec3d& position_offset) const {
    const detail::FilmLayout layout = this->layout();
    PixelData<T> frame;
    frame.width = width_;
    frame.height = height_;
    for (Plane<T, 3>* plane : {&frame.radiance, &frame.variance}) plane->allocate(width_, height_);
    for (Plane<T, 1>* plane : {&frame.alpha, &frame.samples}) plane->allocate(width_, height_);
    if (layout.emission >= 0) frame.emission.allocate(width_, height_);
    if (layout.albedo >= 0) frame.albedo.allocate(width_, height_);
    if (layout.normal >= 0) frame.normal.allocate(width_, height_);
    if (layout.position >= 0) frame.position.allocate(width_, height_);
    if (layout.depth >= 0) frame.depth.allocate(width_, height_);
    if (!material_.empty()) frame.material.allocate(width_, height_);
    struct Part { // of moments: where it stands and where it goes
        int sum;
        Plane<T, 3>*mean, *variance;
    };
    const std::array<Part, 4> parts{{{layout.root_direct, &frame.root_direct, &frame.root_direct_variance},
                                     {layout.root_indirect, &frame.root_indirect, &frame.root_indirect_variance},
                                     {layout.albedo, nullptr, &frame.albedo_variance},
                                     {layout.normal, nullptr, &frame.normal_variance}}};
    for (const Part& part : parts) {
        if (layout.deviation_of(part.sum) < 0) continue;
        if (part.mean != nullptr) part.mean->allocate(width_, height_);
        part.variance->allocate(width_, height_);
    }
    if (layout.direct >= 0) frame.direct.allocate(width_, height_);
    if (layout.indirect >= 0) frame.indirect.allocate(width_, height_);
    if (layout.halves >= 0) frame.halves.allocate(width_, height_);
    for (Plane<T, 1>* plane : {&frame.root_direct_halves, &frame.root_indirect_halves})
        if (layout.root_halves >= 0) plane->allocate(width_, height_);
    const int depth_deviation = layout.deviation_of(layout.depth);
    if (depth_deviation >= 0) frame.depth_variance.allocate(width_, height_);
    if (blocks_.empty()) return frame;

    const auto stored = [](double value) { // an overflowed sum is infinite, the difference of two is NaN
        const T narrow = T(value);
        return is_finite(narrow) ? narrow : std::numeric_limits<T>::max();
    };
    const std::size_t stride = std::size_t(layout.channels);
    std::array<double, detail::FilmLayout::most_channels> sums{};
    const auto mean3 = [&](int channel, double divisor) {
        const double* s = &sums[std::size_t(channel)];
        return Vec3<T>(stored(s[0] / divisor), stored(s[1] / divisor), stored(s[2] / divisor));
    };
    for (int y = 0; y < height_; ++y)
        for (int x = 0; x < width_; ++x) {
            const std::size_t pixel = std::size_t(y) * std::size_t(width_) + std::size_t(x);
            const T* largest = &blocks_.front().sums[pixel * stride];
            std::copy_n(largest, stride, sums.begin());
            double n = double(held(blocks_.front().samples, pixel));
            for (std::size_t b = 1; b < blocks_.size(); ++b) {
                const auto more = double(held(blocks_[b].samples, pixel));
                if (more == 0) continue;
                layout.merge(sums.data(), n, &blocks_[b].sums[pixel * stride], more);
                n += more;
            }
            if (n == 0) continue;
            const double hits = sums[std::size_t(layout.alpha)];
            frame.radiance.store(x, y, mean3(layout.radiance, n));
            if (n > 1) frame.variance.store(x, y, mean3(layout.deviation, n * (n - 1)));
            frame.alpha.store(x, y, T(hits / n));
            frame.samples.store(x, y, T(n));
            if (layout.emission >= 0) frame.emission.store(x, y, mean3(layout.emission, n));
            if (layout.albedo >= 0) frame.albedo.store(x, y, mean3(layout.albedo, n));
            if (layout.normal >= 0) frame.normal.store(x, y, mean3(layout.normal, n));
            if (!material_.empty()) frame.material.store(x, y, T(material_[pixel]));
            if (layout.direct >= 0) frame.direct.store(x, y, mean3(layout.direct, n));
            if (layout.indirect >= 0) frame.indirect.store(x, y, mean3(layout.indirect, n));
            if (layout.halves >= 0) frame.halves.store(x, y, mean3(layout.halves, 1));
            for (const Part& part : parts) {
                if (part.variance->view().absent()) continue;
                if (part.mean != nullptr) part.mean->store(x, y, mean3(part.sum, n));
                if (n > 1) part.variance->store(x, y, mean3(layout.deviation_of(part.sum), n * (n - 1)));
            }
            if (layout.root_halves >= 0) {
                frame.root_direct_halves.store(x, y, stored(sums[std::size_t(layout.root_halves)]));
                frame.root_indirect_halves.store(x, y, stored(sums[std::size_t(layout.root_halves + 1)]));
            }
            if (depth_deviation >= 0 && n > 1)
                frame.depth_variance.store(x, y, stored(sums[std::size_t(depth_deviation)] / (n * (n - 1))));
            if (!(hits > 0)) continue;
            if (layout.position >= 0) {
                const Vec3d p = Vec3d(mean3(layout.position, hits)) + position_offset;
                frame.position.store(x, y, Vec3<T>(stored(p.x), stored(p.y), stored(p.z)));
            }
            if (layout.depth >= 0) frame.depth.store(x, y, stored(sums[std::size_t(layout.depth)] / hits));
        }
    if (contains(planes_, FilmPlanes::illumination)) {
        demodulate(frame); // divides by albedos down to a thousandth
        for (T& v : frame.illumination.values())
            if (!is_finite(v)) v = std::copysign(std::numeric_limits<T>::max(), v);
    }
    return frame;
}

} // namespace LAMBENT_ABI
} // namespace lambent
