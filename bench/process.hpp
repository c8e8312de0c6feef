#pragma once
#include <chrono>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <lambent/core/error.hpp>
#include <string>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

/// A folder that is gone afterwards.
struct TemporaryFolder {
    std::filesystem::path path;
    TemporaryFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "lambent_peers_XXXXXX").string();
        lambent::require(mkdtemp(name.data()) != nullptr, [&] { return name + ": cannot be made"; });
        path = name;
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
};

/// What a program took from start to end, with those that it started. `peak_mib` is at least this process's own
/// memory, which the system counts in before the program starts.
struct Spent {
    double wall_s = 0, cpu_s = 0, peak_mib = 0;
};

enum class Output { lost, kept };

/// Runs a program (found as a shell would) and waits for it; `output`: what becomes of its standard output.
/// throws lambent::Error where it cannot be started or does not end with 0
inline Spent run_process(const std::vector<std::string>& words, Output output = Output::lost) {
    std::vector<char*> argv;
    for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    const auto start = std::chrono::steady_clock::now();
    const pid_t process = fork();
    if (process == 0) {
        if (output == Output::lost) dup2(open("/dev/null", O_WRONLY), STDOUT_FILENO);
        execvp(argv[0], argv.data());
        _exit(127);
    }
    int status = 0;
    rusage usage{};
    lambent::require(wait4(process, &status, 0, &usage) == process && status == 0, [&] {
        std::string command;
        for (const std::string& word : words) command += (command.empty() ? "" : " ") + word;
        const bool started = !WIFEXITED(status) || WEXITSTATUS(status) != 127; // as shells have it
        return "'" + command + (started ? "' failed" : "' cannot be started: is " + words[0] + " installed?");
    });
    const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
    return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
            seconds(usage.ru_utime) + seconds(usage.ru_stime), double(usage.ru_maxrss) / 1024};
}
