// Scene in, EXR out: loads, renders in passes, denoises, writes the image and its planes.
#include "../support/program.hpp"
#include "options.hpp"
#include "pixel.hpp"
#include "run.hpp"
#include "validate.hpp"

int main(int argc, char** argv) {
    return run_program("render", [&] {
        const auto options = parse_options(argc, argv);
        if (!options) return 0;
        if (options->validate) return validate(*options);
        return options->pixel ? show_pixel(*options) : run(*options);
    });
}
