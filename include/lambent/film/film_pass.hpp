#pragma once
#include <lambent/core/error.hpp>
#include <lambent/film/dyadic.hpp>
#include <lambent/film/film.hpp>
#include <lambent/film/film_planes.hpp>
#include <lambent/film/pixel_sample.hpp>
#include <lambent/film/pixel_view.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// Which pixels go on: those that are not 0. Absent: all.
using ActivePixels = PixelView<const std::uint8_t, 1>;

/// One pass over a frame: every pixel adds the samples [begin, end) in ascending order, any pixel on any
/// thread; finish() gives a film of them. Pixels that are not active stop at the last power of two up to `begin`.
template <class T>
class FilmPass {
public:
    /// throws lambent::Error on an empty or negative size, active pixels of another size, and a stop at 0
    FilmPass(int width, int height, FilmPlanes planes, std::uint64_t begin, std::uint64_t end,
             const ActivePixels& active = {})
        : film_(width, height, planes), layout_(planes), begin_(begin) {
        if (!active.absent()) stop_others(active);
        for (const DyadicBlock& samples : dyadic_blocks(begin, end))
            film_.blocks_.push_back({samples, std::vector<T>(film_.pixel_count() * std::size_t(layout_.channels))});
    }

    /// Sums the samples of one pixel in a binary counter of partial sums and files them at the end.
    class Pixel {
    public:
        Pixel(FilmPass& pass, int x, int y) : pass_(pass), pixel_(index(x, y)), next_(pass.begin_) {}

        /// Files the sums, and begins those of another pixel.
        void go_to(int x, int y) {
            file();
            pixel_ = index(x, y);
            next_ = pass_.begin_;
            rejected_ = depth_ = 0;
        }

        /// Takes the next sample; one that is not finite is counted, and summed as make_finite() leaves it.
        void add(PixelSample<T> sample) {
            if (!make_finite(sample)) ++rejected_;
            push(sample, {next_, 0});
        }

        /// Takes the next `count` samples, which are all the same, as add() would one by one: to the same bits.
        /// cost  grows with the logarithm of their number
        void add_equal(PixelSample<T> sample, std::uint64_t count) {
            if (!make_finite(sample)) rejected_ += count;
            for (const std::uint64_t end = next_ + count; next_ < end;)
                push(sample, dyadic_block_at(next_, end, end - next_));
        }

        ~Pixel() { file(); }
        Pixel(const Pixel&) = delete;
        Pixel& operator=(const Pixel&) = delete;

    private:
        using Sums = std::array<T, detail::FilmLayout::most_channels>;

        std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(pass_.film_.width_) + std::size_t(x); }

        void file() {
            const std::size_t stride = std::size_t(pass_.layout_.channels);
            for (std::size_t i = 0; i < depth_ && i < pass_.film_.blocks_.size(); ++i)
                std::copy_n(sums_[i].begin(), stride, &pass_.film_.blocks_[i].sums[pixel_ * stride]);
            if (rejected_ > 0) pass_.rejected_ += rejected_;
        }

        /// A block of samples that are all this one.
        void push(const PixelSample<T>& sample, const DyadicBlock& block) {
            if (next_ == pass_.begin_ && !pass_.film_.material_.empty())
                pass_.film_.material_[pixel_] = sample.hit ? std::int32_t(sample.material) : -1;
            Sums& sums = sums_[depth_];
            pass_.layout_.pack(sample, sums.data());
            for (std::uint64_t n = 1; n < block.size(); n *= 2) {
                const Sums other = sums;
                pass_.layout_.merge_halves(sums.data(), other.data(), double(n));
            }
            samples_[depth_++] = block;
            next_ = block.end();
            while (depth_ > 1 && samples_[depth_ - 2].joins(samples_[depth_ - 1])) {
                DyadicBlock& left = samples_[depth_ - 2];
                pass_.layout_.merge_halves(sums_[depth_ - 2].data(), sums_[depth_ - 1].data(), double(left.size()));
                ++left.level;
                --depth_;
            }
        }

        static constexpr std::size_t most = 66; // at most 33 blocks up to the largest and 33 down again

        FilmPass& pass_;
        std::size_t pixel_;
        std::uint64_t next_;
        std::uint64_t rejected_ = 0;
        std::size_t depth_ = 0;
        std::array<DyadicBlock, most> samples_;
        std::array<Sums, most> sums_;
    };

    /// Call once, when all pixels are done.
    Film<T> finish() {
        film_.rejected_ = rejected_;
        return std::move(film_);
    }

private:
    void stop_others(const ActivePixels& active) {
        require(active.width() == film_.width_ && active.height() == film_.height_, [&] {
            return "FilmPass: " + std::to_string(active.width()) + " x " + std::to_string(active.height()) +
                   " active pixels for a film of " + film_.shape();
        });
        std::vector<typename Film<T>::Stop> stops(film_.pixel_count(), Film<T>::goes_on);
        bool stopped = false;
        for (int y = 0; y < film_.height_; ++y)
            for (int x = 0; x < film_.width_; ++x) {
                if (active.load(x, y) != 0) continue;
                stopped = true;
                stops[std::size_t(y) * std::size_t(film_.width_) + std::size_t(x)] =
                    std::uint8_t(std::bit_width(begin_) - 1);
            }
        if (!stopped) return;
        require(begin_ > 0 && begin_ < std::uint64_t(1) << 32,
                [&] { return "FilmPass: no pixel can stop at sample " + std::to_string(begin_); });
        film_.stops_ = std::move(stops);
    }

    Film<T> film_;
    detail::FilmLayout layout_;
    std::uint64_t begin_;
    std::atomic<std::uint64_t> rejected_{0};
};

} // namespace LAMBENT_ABI
} // namespace lambent
