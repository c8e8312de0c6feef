#pragma once
#include <lambent/core/error.hpp>
#include <lambent/core/numerics.hpp>
#include <lambent/core/vec.hpp>
#include <lambent/film/pixel_data.hpp>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What one sample of one pixel brings home. A miss leaves the features at 0 and `hit` false.
template <class T>
struct PixelSample {
    Vec3<T> radiance{0};  ///< linear Rec.709, emission included
    Vec3<T> emission{0};  ///< the part seen directly: the first hit's own light, or the background
    Vec3<T> albedo{0};    ///< reflectance at the first hit
    Vec3<T> normal{0};    ///< shading normal there, towards the viewer
    Vec3<T> position{0};  ///< of the first hit, relative to the scene's origin
    T depth = 0;          ///< distance to it
    std::uint32_t material = 0;
    bool hit = false;
};

/// Which accumulators a film has. `radiance` alone keeps radiance, its variance and alpha.
enum class FilmPlanes : std::uint8_t { radiance, features };

/// The samples [first, first + 2^level): a block of a dyadic partition.
struct DyadicBlock {
    std::uint64_t first = 0;
    std::uint32_t level = 0;

    std::uint64_t size() const { return std::uint64_t(1) << level; }
    std::uint64_t end() const { return first + size(); }
    /// Whether the two halves of one aligned block are this and `next`.
    bool joins(const DyadicBlock& next) const {
        return level == next.level && next.first == end() && first % (2 * size()) == 0;
    }
};

/// The one partition of the samples [begin, end) into the largest aligned dyadic blocks.
inline std::vector<DyadicBlock> dyadic_blocks(std::uint64_t begin, std::uint64_t end) {
    std::vector<DyadicBlock> blocks;
    while (begin < end) {
        std::uint32_t level = 0;
        while (begin % (std::uint64_t(2) << level) == 0 && begin + (std::uint64_t(2) << level) <= end) ++level;
        blocks.push_back({begin, level});
        begin = blocks.back().end();
    }
    return blocks;
}

namespace detail {

/// Sums over a block of samples: channels in the order of FilmLayout, then the sum of squared deviations of
/// radiance from the block's mean.
template <class T>
struct FilmLayout {
    static constexpr int radiance = 0, deviation = 3, alpha = 6, emission = 7, albedo = 10, normal = 13,
                         position = 16, depth = 19, count = 20;

    static constexpr int channels(FilmPlanes planes) { return planes == FilmPlanes::radiance ? emission : count; }

    static void pack(const PixelSample<T>& s, T* out, int channels) {
        for (int c = 0; c < 3; ++c) {
            out[radiance + c] = s.radiance[c];
            out[deviation + c] = 0;
        }
        out[alpha] = s.hit ? T(1) : T(0);
        if (channels == emission) return;
        for (int c = 0; c < 3; ++c) {
            out[emission + c] = s.emission[c];
            out[albedo + c] = s.albedo[c];
            out[normal + c] = s.normal[c];
            out[position + c] = s.position[c];
        }
        out[depth] = s.depth;
    }

    /// Adds the sums of the nb samples in b to those of the na samples in a.
    /// source  Chan, Golub, LeVeque, The American Statistician 37:3 (1983), for the deviations
    static void merge(T* a, double na, const T* b, double nb, int channels) {
        const T weight = T(na * nb / (na + nb));
        for (int c = 0; c < 3; ++c) {
            const T difference = b[radiance + c] / T(nb) - a[radiance + c] / T(na);
            a[deviation + c] += b[deviation + c] + weight * difference * difference;
        }
        for (int c = 0; c < 3; ++c) a[radiance + c] += b[radiance + c];
        for (int c = alpha; c < channels; ++c) a[c] += b[c];
    }
};

} // namespace detail

/// Accumulators of a frame. Samples are summed pairwise over aligned dyadic blocks of sample indices, so the
/// rounding error grows with log2 of their number and the sums depend on *which* samples are in, not on how
/// they were split between threads, passes, runs or machines: any split merges to the same bits.
/// The samples of one film need not be contiguous; no sample is in twice.
template <class T>
class Film {
public:
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
        material_.assign(pixel_count(), -1);
    }

    int width() const { return width_; }
    int height() const { return height_; }
    FilmPlanes planes() const { return planes_; }
    int channels() const { return detail::FilmLayout<T>::channels(planes_); }
    std::size_t pixel_count() const { return std::size_t(width_) * std::size_t(height_); }
    const std::vector<Block>& blocks() const { return blocks_; }
    const std::vector<std::int32_t>& material() const { return material_; }

    std::uint64_t sample_count() const {
        std::uint64_t n = 0;
        for (const Block& b : blocks_) n += b.samples.size();
        return n;
    }
    /// Index of the first sample that is in; `material` is that sample's.
    std::uint64_t first_sample() const { return blocks_.empty() ? ~std::uint64_t(0) : blocks_.front().samples.first; }

    /// Adds all samples of `other`; equal to having rendered them here.
    /// throws lambent::Error when sizes or planes differ or a sample is in both
    void merge(Film other) {
        require(width_ == other.width_ && height_ == other.height_ && planes_ == other.planes_, [&] {
            return "Film: cannot merge " + describe() + " with " + other.describe();
        });
        for (const Block& a : blocks_)
            for (const Block& b : other.blocks_)
                require(a.samples.end() <= b.samples.first || b.samples.end() <= a.samples.first, [&] {
                    const auto range = [](const DyadicBlock& d) {
                        return "[" + std::to_string(d.first) + ", " + std::to_string(d.end()) + ")";
                    };
                    return "Film: samples " + range(a.samples) + " and " + range(b.samples) + " overlap";
                });
        if (other.first_sample() < first_sample()) material_ = std::move(other.material_);
        for (Block& b : other.blocks_) blocks_.push_back(std::move(b));
        std::sort(blocks_.begin(), blocks_.end(),
                  [](const Block& a, const Block& b) { return a.samples.first < b.samples.first; });
        join_halves();
    }

    /// Takes a block as it was saved; blocks must come in ascending order.
    /// throws lambent::Error on a wrong size, an unaligned block or an overlap
    void restore(Block block) {
        const DyadicBlock& s = block.samples;
        require(block.sums.size() == pixel_count() * std::size_t(channels()) && s.level < 40 &&
                    s.first % s.size() == 0 && (blocks_.empty() || blocks_.back().samples.end() <= s.first),
                [&] { return "Film: block of samples at " + std::to_string(s.first) + " does not fit"; });
        blocks_.push_back(std::move(block));
    }
    void restore_material(std::vector<std::int32_t> material) {
        require(material.size() == pixel_count(), "Film: wrong number of material indices");
        material_ = std::move(material);
    }

    /// The means, as planes. `position_offset` is added to positions (the scene's origin). Features are
    /// absent unless the film has them; `illumination` is derived.
    PixelData<T> resolve(const Vec3d& position_offset = Vec3d(0)) const;

private:
    template <class U> friend class FilmPass;

    void join_halves() {
        using Layout = detail::FilmLayout<T>;
        std::vector<Block> joined;
        for (Block& block : blocks_) {
            joined.push_back(std::move(block));
            while (joined.size() > 1 && joined[joined.size() - 2].samples.joins(joined.back().samples)) {
                Block& left = joined[joined.size() - 2];
                const double n = double(left.samples.size());
                const std::size_t stride = std::size_t(channels());
                for (std::size_t i = 0; i < left.sums.size(); i += stride)
                    Layout::merge(&left.sums[i], n, &joined.back().sums[i], n, channels());
                ++left.samples.level;
                joined.pop_back();
            }
        }
        blocks_ = std::move(joined);
    }

    std::string describe() const {
        return std::to_string(width_) + " x " + std::to_string(height_) +
               (planes_ == FilmPlanes::features ? " with features" : " without features");
    }

    int width_ = 0, height_ = 0;
    FilmPlanes planes_ = FilmPlanes::features;
    std::vector<Block> blocks_;
    std::vector<std::int32_t> material_; ///< of the first sample; -1 = miss
};

/// One pass over a frame: every pixel adds the samples [begin, end) in ascending order, any pixel on any
/// thread; finish() gives a film of them.
template <class T>
class FilmPass {
public:
    FilmPass(int width, int height, FilmPlanes planes, std::uint64_t begin, std::uint64_t end)
        : film_(width, height, planes), begin_(begin) {
        for (const DyadicBlock& samples : dyadic_blocks(begin, end))
            film_.blocks_.push_back({samples, std::vector<T>(film_.pixel_count() * std::size_t(film_.channels()))});
    }

    /// Sums the samples of one pixel in a binary counter of partial sums and files them at the end.
    class Pixel {
    public:
        Pixel(FilmPass& pass, int x, int y)
            : pass_(pass), pixel_(std::size_t(y) * std::size_t(pass.film_.width_) + std::size_t(x)),
              channels_(pass.film_.channels()), next_(pass.begin_) {}

        void add(const PixelSample<T>& sample) {
            using Layout = detail::FilmLayout<T>;
            if (next_ == pass_.begin_) pass_.film_.material_[pixel_] = sample.hit ? std::int32_t(sample.material) : -1;
            Entry& top = stack_[depth_++];
            top.samples = {next_++, 0};
            Layout::pack(sample, top.sums.data(), channels_);
            while (depth_ > 1 && stack_[depth_ - 2].samples.joins(stack_[depth_ - 1].samples)) {
                Entry& left = stack_[depth_ - 2];
                const double n = double(left.samples.size());
                Layout::merge(left.sums.data(), n, stack_[depth_ - 1].sums.data(), n, channels_);
                ++left.samples.level;
                --depth_;
            }
        }

        ~Pixel() {
            const std::size_t stride = std::size_t(channels_);
            for (std::size_t i = 0; i < depth_ && i < pass_.film_.blocks_.size(); ++i)
                std::copy_n(stack_[i].sums.begin(), channels_, &pass_.film_.blocks_[i].sums[pixel_ * stride]);
        }
        Pixel(const Pixel&) = delete;
        Pixel& operator=(const Pixel&) = delete;

    private:
        struct Entry {
            DyadicBlock samples;
            std::array<T, detail::FilmLayout<T>::count> sums;
        };
        FilmPass& pass_;
        std::size_t pixel_;
        int channels_;
        std::uint64_t next_;
        std::size_t depth_ = 0;
        std::array<Entry, 80> stack_; // at most 40 blocks up to the largest and 40 down again
    };

    Film<T> finish() { return std::move(film_); }

private:
    Film<T> film_;
    std::uint64_t begin_;
};

template <class T>
PixelData<T> Film<T>::resolve(const Vec3d& position_offset) const {
    using Layout = detail::FilmLayout<T>;
    PixelData<T> frame;
    frame.width = width_;
    frame.height = height_;
    const bool features = planes_ == FilmPlanes::features;
    for (Plane<T, 3>* plane : {&frame.radiance, &frame.variance}) plane->allocate(width_, height_);
    for (Plane<T, 1>* plane : {&frame.alpha, &frame.samples}) plane->allocate(width_, height_);
    if (features) {
        for (Plane<T, 3>* plane : {&frame.emission, &frame.albedo, &frame.normal, &frame.position})
            plane->allocate(width_, height_);
        for (Plane<T, 1>* plane : {&frame.depth, &frame.material}) plane->allocate(width_, height_);
    }
    const double n = double(sample_count());
    if (blocks_.empty()) return frame;

    const std::size_t stride = std::size_t(channels());
    std::array<T, Layout::count> sums{};
    for (int y = 0; y < height_; ++y)
        for (int x = 0; x < width_; ++x) {
            const std::size_t pixel = std::size_t(y) * std::size_t(width_) + std::size_t(x);
            // The smallest blocks come last: from there to the front, like is added to like.
            double total = 0;
            for (std::size_t b = blocks_.size(); b-- > 0;) {
                const Block& block = blocks_[b];
                std::array<T, Layout::count> left{};
                std::copy_n(&block.sums[pixel * stride], stride, left.begin());
                if (total > 0) Layout::merge(left.data(), double(block.samples.size()), sums.data(), total, channels());
                sums = left;
                total += double(block.samples.size());
            }
            const auto mean3 = [&](int channel, T divisor) {
                return Vec3<T>(sums[std::size_t(channel)], sums[std::size_t(channel) + 1],
                               sums[std::size_t(channel) + 2]) / divisor;
            };
            const T hits = sums[Layout::alpha];
            frame.radiance.view().store(x, y, mean3(Layout::radiance, T(n)));
            if (n > 1) frame.variance.view().store(x, y, mean3(Layout::deviation, T(n * (n - 1))));
            frame.alpha.view().store(x, y, hits / T(n));
            frame.samples.view().store(x, y, T(n));
            if (!features) continue;
            frame.emission.view().store(x, y, mean3(Layout::emission, T(n)));
            frame.albedo.view().store(x, y, mean3(Layout::albedo, T(n)));
            frame.normal.view().store(x, y, mean3(Layout::normal, T(n)));
            frame.material.view().store(x, y, T(material_[pixel]));
            if (hits > 0) {
                frame.position.view().store(
                    x, y, Vec3<T>(Vec3d(mean3(Layout::position, hits)) + position_offset));
                frame.depth.view().store(x, y, sums[Layout::depth] / hits);
            }
        }
    if (features) demodulate(frame);
    return frame;
}

} // namespace LAMBENT_ABI
} // namespace lambent
