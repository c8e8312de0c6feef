#pragma once
#include <support/temporary_folder.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace lambent_test {

/// Programs, run in a folder of their own.
class Desk {
public:
    /// Exit code of `program arguments`; what it says is in said().
    int run(const std::string& program, const std::string& arguments) {
        const std::string command = "cd '" + folder_.file("") + "' && '" + program + "' " + arguments + " >said 2>&1";
        const int status = std::system(command.c_str());
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    int render(const std::string& arguments) {
        return run(LAMBENT_RENDER, "builtin:cornell --size 32x24 --quiet " + arguments);
    }
    int merge(const std::string& arguments) { return run(LAMBENT_MERGE, arguments + " --quiet"); }

    void write(const std::string& name, const std::string& bytes) const { folder_.write(name, bytes); }
    std::string said() const { return file_bytes(folder_.file("said")); }
    std::string bytes(const std::string& name) const { return file_bytes(folder_.file(name)); }
    std::string path(const std::string& name) const { return folder_.file(name); }
    bool exists(const std::string& name) const { return std::filesystem::exists(folder_.file(name)); }
    bool same(const std::string& a, const std::string& b) const {
        return exists(a) && exists(b) && bytes(a) == bytes(b);
    }
    bool says(const std::string& text) const { return said().find(text) != std::string::npos; }
    /// How many files there are but for `said`.
    std::size_t count() const { return folder_.count() - (exists("said") ? 1 : 0); }

    /// Starts a long render that saves as it goes, waits for its first state and sends it a signal; its exit code,
    /// negative for a death by signal.
    int render_until(int signal) {
        std::filesystem::remove(path("out.film"));
        const pid_t child = fork();
        if (child == 0) {
            std::filesystem::current_path(folder_.file(""));
            if (std::freopen("said", "w", stderr) == nullptr) _exit(99);
            execl(LAMBENT_RENDER, "render", "builtin:cornell", "--size", "32x24", "--spp", "1000000", "--quiet",
                  "--checkpoint", static_cast<char*>(nullptr));
            _exit(99);
        }
        for (int i = 0; i < 1200 && !exists("out.film"); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(50));
        kill(child, signal);
        int status = 0;
        waitpid(child, &status, 0);
        return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    }

private:
    TemporaryFolder folder_;
};

} // namespace lambent_test
