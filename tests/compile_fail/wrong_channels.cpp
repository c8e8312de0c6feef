// names: PixelView<const float, ?3>
#include <lambent/film/pixel_view.hpp>

#ifdef RIGHT
constexpr int channels = 3;
#else
constexpr int channels = 4;
#endif

void filter(lambent::PixelView<const float, 3>);

void use(float* pixels) { filter(lambent::PixelView<float, channels>(pixels, 2, 2)); }
