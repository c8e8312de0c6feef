// names: is_const_v
#include <lambent/film/pixel_view.hpp>

#ifdef RIGHT
using Pixel = float;
#else
using Pixel = const float;
#endif

void use(Pixel* pixels) { lambent::PixelView<Pixel, 1>(pixels, 2, 2).store(0, 0, 1.0f); }
