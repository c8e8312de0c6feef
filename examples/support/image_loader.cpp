// Linked into a program, this makes PNG and JPEG work by loading OpenImageIO on first use. Linked directly, OpenImageIO
// and its 260 shared objects would take every run a fraction of a second to start, whether it has textures or not.
// LAMBENT_IMAGE_MODULE is the file name of the module; the system looks where the program's RUNPATH says: beside it.
#include <lambent/io/image_codec.hpp>
#include <dlfcn.h>
#include <string>

namespace {

struct Module {
    lambent::ImageCodec codec;
    std::string error;

    Module() {
        using Entry = const lambent::ImageCodec* (*)();
        void* const module = dlopen(LAMBENT_IMAGE_MODULE, RTLD_LAZY | RTLD_LOCAL); // for as long as the program runs
        void* const entry = module != nullptr ? dlsym(module, "lambent_image_codec") : nullptr;
        if (entry != nullptr) codec = *reinterpret_cast<Entry>(entry)();
        else error = std::string("OpenImageIO cannot be loaded: ") + dlerror();
    }
    static const Module& loaded() {
        static const Module module;
        return module;
    }
};

[[maybe_unused]] const bool in_use = [] {
    lambent::image_codec().decode = [](auto... arguments) {
        const Module& module = Module::loaded();
        return module.error.empty() ? module.codec.decode(arguments...) : module.error;
    };
    lambent::image_codec().encode_png = [](const std::uint8_t* rgb, int width, int height, std::string& file) {
        const Module& module = Module::loaded();
        return module.error.empty() ? module.codec.encode_png(rgb, width, height, file) : module.error;
    };
    return true;
}();

} // namespace
