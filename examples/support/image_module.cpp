// OpenImageIO for the programs beside this file, which load it when they first need it: see image_loader.cpp.
#include <lambent/io/image_codec.hpp>

extern "C" const lambent::ImageCodec* lambent_image_codec() { return &lambent::image_codec(); }
