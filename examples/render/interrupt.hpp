#pragma once
#include <csignal>
#include <initializer_list>

/// Ctrl-C, and the polite kill: the first asks the program to save what there is, a second one ends it.
namespace interrupt {
inline volatile std::sig_atomic_t flag = 0;

inline bool asked() { return flag != 0; }

inline void listen() {
    for (const int signal : {SIGINT, SIGTERM})
        std::signal(signal, [](int number) {
            flag = 1;
            std::signal(number, SIG_DFL);
        });
}
} // namespace interrupt
