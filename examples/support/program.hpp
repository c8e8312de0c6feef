#pragma once
#include "command_line.hpp"
#include <cstdio>
#include <exception>
#include <new>

/// The body of a main(): calls `body`, which returns the exit code, and says on stderr what it throws. The programs'
/// exit codes: 0 done, 1 an error of scene or files, 2 a wrong command line, 130 interrupted with what there is saved.
template <class Body>
int run_program(const char* name, Body&& body) {
    try {
        return body();
    } catch (const UsageError& e) {
        std::fprintf(stderr, "%s: %s\n%s --help lists the options\n", name, e.what(), name);
        return 2;
    } catch (const std::bad_alloc&) {
        std::fprintf(stderr, "%s: not enough memory\n", name);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s: %s\n", name, e.what());
    }
    return 1;
}
