// Scene in, EXR out: loads, renders in passes, denoises, writes the image and its planes.
#include "options.hpp"
#include "run.hpp"
#include "validate.hpp"
#include <cstdio>
#include <exception>
#include <new>

int main(int argc, char** argv) {
    try {
        const auto options = parse_options(argc, argv);
        if (!options) return 0;
        return options->validate ? validate(*options) : run(*options);
    } catch (const UsageError& e) {
        std::fprintf(stderr, "render: %s\nrender --help lists the options\n", e.what());
        return 2;
    } catch (const std::bad_alloc&) {
        std::fprintf(stderr, "render: not enough memory\n");
    } catch (const std::exception& e) {
        std::fprintf(stderr, "render: %s\n", e.what());
    }
    return 1;
}
