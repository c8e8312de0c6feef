// Scene in, EXR out: loads, renders in passes, writes the image and its planes.
#include "../support/command_line.hpp"
#include "options.hpp"
#include "output.hpp"
#include "scene_setup.hpp"
#include "trace.hpp"
#include <csignal>
#include <cstdio>

int main(int argc, char** argv) {
    try {
        const Options options = parse_options(argc, argv);
        std::signal(SIGINT, [](int) { interrupted = 1; });
        return run(options);
    } catch (const UsageError& e) {
        std::fprintf(stderr, "render: %s\nrender --help lists the options\n", e.what());
        return 2;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "render: %s\n", e.what());
        return 1;
    }
}
