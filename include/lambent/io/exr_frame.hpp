#pragma once
#include <lambent/film/pixel_data.hpp>
#include <lambent/film/region.hpp>
#include <lambent/io/exr.hpp>
#include <lambent/scene/camera.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lambent {
inline namespace LAMBENT_ABI {

/// What EXR channels are stored as.
enum class ExrPrecision : std::uint8_t {
    compact, ///< half where it will do; float32 for positions, distances, variances, counts and large values
    full     ///< float32 throughout
};

/// How a frame is written.
template <class T>
struct ExrFrameOptions {
    PixelView<const T, 3> denoised{}; ///< becomes R G B, the radiance noisy.*; absent: R G B
    PixelView<const T, 3> error{};    ///< denoised_error() of it
    ExrPrecision precision = ExrPrecision::compact;
    std::optional<std::vector<std::string>> layers{}; ///< which of "noisy", "albedo", "illumination",
                                                      ///< "emission", "N", "P", "Z", "material", "samples",
                                                      ///< "variance", "error", "statistics" to write; unset: all
                                                      ///< that the frame has but the last two
    std::map<std::string, ExrValue> attributes{}; ///< spp, seed, version … and camera_attributes()
    PixelWindow window{};                         ///< where the frame lies in the whole image; empty = it is all
    int image_width = 0, image_height = 0;        ///< of the whole image, where there is a window
};

/// The standard attributes worldToCamera and worldToNDC (RenderMan's left-handed camera space, +z ahead; NDC
/// with (0, 0) in the upper left corner after division by w).
inline std::map<std::string, ExrValue> camera_attributes(const Camera& camera, int width, int height) {
    const Vec3d ahead = normalize(camera.target - camera.eye);
    Vec3d right = cross(ahead, camera.up);
    if (!(dot(right, right) > 1e-24))
        right = cross(ahead, std::abs(ahead.y) < 0.9 ? Vec3d(0, 1, 0) : Vec3d(0, 0, -1));
    right = normalize(right);
    const Vec3d up = cross(right, ahead);
    Mat4d to_camera(1.0);
    for (int k = 0; k < 3; ++k) {
        to_camera[k][0] = right[k];
        to_camera[k][1] = up[k];
        to_camera[k][2] = ahead[k];
    }
    to_camera[3] = {-dot(right, camera.eye), -dot(up, camera.eye), -dot(ahead, camera.eye), 1};
    const double half = std::tan(camera.vertical_fov * pi<double> / 360);
    Mat4d project(0.0);
    project[0][0] = 0.5 * double(height) / (half * double(width));
    project[1][1] = -0.5 / half;
    project[2] = {0.5, 0.5, 1, 1};
    return {{"worldToCamera", to_camera}, {"worldToNDC", project * to_camera}};
}

namespace detail {
/// Calls f(layer, suffixes, plane) with all that denoise_light() asks for besides the other layers.
template <class Frame, class F>
void for_each_statistic(Frame& frame, F&& f) {
    f("direct", "RGB", frame.direct);
    f("indirect", "RGB", frame.indirect);
    f("root_direct", "RGB", frame.root_direct);
    f("root_direct_variance", "RGB", frame.root_direct_variance);
    f("root_indirect", "RGB", frame.root_indirect);
    f("root_indirect_variance", "RGB", frame.root_indirect_variance);
    f("halves", "RGB", frame.halves);
    f("root_direct_halves", "Y", frame.root_direct_halves);
    f("root_indirect_halves", "Y", frame.root_indirect_halves);
    f("albedo_variance", "RGB", frame.albedo_variance);
    f("N_variance", "XYZ", frame.normal_variance);
    f("Z_variance", "Y", frame.depth_variance);
}
} // namespace detail

/// The frame's planes under their names: R G B A, noisy.*, albedo.*, illumination.*, emission.*,
/// N.X/Y/Z, P.X/Y/Z, Z (along the ray), material.Y, samples.Y, variance.*, error.*, and those of statistics: direct.*,
/// indirect.*, root_direct.* and so on; absent planes are left out.
/// throws lambent::Error when there is no radiance or sizes differ
template <class T>
ExrImage to_exr(const PixelData<T>& frame, const ExrFrameOptions<T>& options = {}) {
    require(!frame.radiance.absent(), "to_exr: the frame has no radiance plane");
    ExrImage image;
    image.attributes = options.attributes;
    if (!options.window.empty()) {
        require(options.window.width() == frame.width && options.window.height() == frame.height &&
                    options.window.inside(options.image_width, options.image_height),
                "to_exr: the window does not fit the frame and the image");
        image.left = options.window.x0;
        image.top = options.window.y0;
        image.display_width = options.image_width;
        image.display_height = options.image_height;
    }
    const auto wanted = [&](const std::string& layer) {
        return !options.layers ||
               std::find(options.layers->begin(), options.layers->end(), layer) != options.layers->end();
    };
    const auto write = [&](const std::string& layer, std::string_view suffixes, const auto& view,
                           ExrType type) {
        if (view.absent()) return;
        const std::size_t first = image.channels.size();
        image.add(layer, suffixes, view, type);
        const auto beyond_half = [](const ExrChannel& c) {
            return std::any_of(c.values.begin(), c.values.end(),
                               [](float v) { return std::abs(v) > 65504.0f; });
        };
        const auto begin = image.channels.begin() + std::ptrdiff_t(first);
        if (options.precision == ExrPrecision::full || std::any_of(begin, image.channels.end(), beyond_half))
            std::for_each(begin, image.channels.end(), [](ExrChannel& c) { c.type = ExrType::float32; });
    };
    const auto write_layer = [&](const std::string& layer, const std::string& name, std::string_view suffixes,
                                 const auto& plane, ExrType type) {
        if (wanted(layer)) write(name, suffixes, plane.view(), type);
    };
    const bool denoised = !options.denoised.absent();
    write("", "RGB", denoised ? options.denoised : frame.radiance.view(), ExrType::half);
    write("", "A", frame.alpha.view(), ExrType::half);
    if (denoised) write_layer("noisy", "noisy", "RGB", frame.radiance, ExrType::half);
    write_layer("albedo", "albedo", "RGB", frame.albedo, ExrType::half);
    write_layer("illumination", "illumination", "RGB", frame.illumination, ExrType::half);
    write_layer("emission", "emission", "RGB", frame.emission, ExrType::half);
    write_layer("N", "N", "XYZ", frame.normal, ExrType::half);
    write_layer("P", "P", "XYZ", frame.position, ExrType::float32);
    write_layer("Z", "", "Z", frame.depth, ExrType::float32);
    write_layer("material", "material", "Y", frame.material, ExrType::float32);
    write_layer("samples", "samples", "Y", frame.samples, ExrType::float32);
    write_layer("variance", "variance", "RGB", frame.variance, ExrType::float32);
    if (options.layers && wanted("error")) write("error", "RGB", options.error, ExrType::float32);
    if (options.layers && wanted("statistics"))
        detail::for_each_statistic(frame, [&](const char* name, std::string_view suffixes, const auto& plane) {
            write(name, suffixes, plane.view(), ExrType::float32);
        });
    return image;
}

/// Writes a frame as to_exr() names it.
/// throws lambent::Error when there is no radiance, sizes differ or the file cannot be written
template <class T>
void write_exr(const std::string& path, const PixelData<T>& frame, const ExrFrameOptions<T>& options = {}) {
    write_exr(path, to_exr(frame, options));
}

namespace detail {

inline std::string lower_case(std::string_view text) {
    std::string out(text);
    for (char& c : out)
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    return out;
}

/// The last component of a layer's name in lower case: "ViewLayer.Noisy Image" → "noisy image".
inline std::string layer_key(const std::string& channel) {
    const std::size_t dot = channel.find_last_of('.');
    if (dot == std::string::npos) return {};
    const std::string layer = channel.substr(0, dot);
    const std::size_t before = layer.find_last_of('.');
    return lower_case(before == std::string::npos ? layer : layer.substr(before + 1));
}

/// What follows the last dot.
inline std::string_view channel_suffix(std::string_view channel) {
    const std::size_t dot = channel.find_last_of('.');
    return dot == std::string_view::npos ? channel : channel.substr(dot + 1);
}

/// Fills `plane` from the first of `layers` (keys as of layer_key) that has every channel of one of the
/// suffix sets; leaves it absent otherwise.
template <class T, int C>
inline bool find_plane(const ExrImage& image, std::initializer_list<const char*> layers,
                       std::initializer_list<std::string_view> suffix_sets, Plane<T, C>& plane) {
    for (const char* layer : layers)
        for (const std::string_view suffixes : suffix_sets) {
            std::array<const ExrChannel*, std::size_t(C)> found{};
            std::size_t count = 0;
            for (std::size_t c = 0; c < found.size(); ++c)
                for (const ExrChannel& channel : image.channels)
                    if (found[c] == nullptr && channel_suffix(channel.name) == suffixes.substr(c, 1) &&
                        layer_key(channel.name) == layer) {
                        found[c] = &channel;
                        ++count;
                    }
            if (count < found.size()) continue;
            plane.allocate(image.width, image.height);
            for (std::size_t i = 0; i < plane.values().size(); ++i)
                plane.values()[i] = T(found[i % found.size()]->values[i / found.size()]);
            return true;
        }
    return false;
}

/// pbrt's Variance is that of single samples (film.cpp, GBufferFilm): over their number it is the mean's, and without it,
/// of no use.
template <class T>
void take_sample_variance(const ExrImage& image, PixelData<T>& frame) {
    if (frame.variance.absent()) return;
    const auto spp = image.attributes.find("samplesPerPixel");
    const int* const samples = spp != image.attributes.end() ? std::get_if<int>(&spp->second) : nullptr;
    if (samples == nullptr || *samples < 1) {
        frame.variance = {};
        return;
    }
    for (T& v : frame.variance.values()) v /= T(*samples);
    frame.samples.allocate(image.width, image.height, T(*samples));
}

} // namespace detail

/// The planes that a denoiser wants, by our names and those of Blender (ViewLayer.Combined, Noisy Image,
/// Denoising Albedo, Denoising Normal, Depth), Mitsuba 3 (its AOVs under their types' names) and pbrt
/// (Albedo, Ns, N, P, Variance and samplesPerPixel). Our denoised files give their noisy radiance. What a file lacks is absent;
/// its values are taken as they are, also those that are not finite.
/// throws lambent::Error when there is no radiance
template <class T = float>
PixelData<T> frame_from_exr(const ExrImage& image) {
    PixelData<T> frame;
    frame.width = image.width;
    frame.height = image.height;
    require(detail::find_plane(image,
                               {"noisy", "noisy image", "combined", "", "rgba", "beauty", "color", "image"},
                               {"RGB"}, frame.radiance),
            [&] {
                std::string names;
                for (const ExrChannel& c : image.channels) names += (names.empty() ? "" : ", ") + c.name;
                return "no radiance among the channels " + names;
            });
    detail::find_plane(image, {"emission", "emit"}, {"RGB"}, frame.emission);
    detail::find_plane(image, {"albedo", "denoising albedo", "diffcol"}, {"RGB"}, frame.albedo);
    detail::find_plane(image, {"illumination"}, {"RGB"}, frame.illumination);
    detail::find_plane(image, {"ns", "sh_normal", "denoising normal", "n", "normal", "geo_normal"}, {"XYZ"},
                       frame.normal);
    detail::find_plane(image, {"p", "position"}, {"XYZ"}, frame.position);
    if (!detail::find_plane(image, {""}, {"Z"}, frame.depth)) // a lone Y is luminance
        detail::find_plane(image, {"depth"}, {"Z", "T", "V", "Y"}, frame.depth);
    detail::find_plane(image, {"material"}, {"Y"}, frame.material);
    detail::find_plane(image, {""}, {"A"}, frame.alpha);
    detail::find_plane(image, {"samples", "debug sample count"}, {"Y", "X"}, frame.samples);
    detail::find_plane(image, {"variance"}, {"RGB"}, frame.variance);
    if (image.find("RelativeVariance.R") != nullptr) detail::take_sample_variance(image, frame);
    detail::for_each_statistic(frame, [&](const char* name, std::string_view suffixes, auto& plane) {
        const std::string key = detail::lower_case(name);
        detail::find_plane(image, {key.c_str()}, {suffixes}, plane);
    });
    return frame;
}

} // namespace LAMBENT_ABI
} // namespace lambent
