#pragma once
#include "../report/rows.hpp"
#include <chrono>
#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <lambent/core/error.hpp>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

/// Another renderer: a Python script that has loaded a scene and waits for work. It inherits the processor that the
/// caller is pinned to. worker.py is the other side.
class Peer {
public:
    struct Answer {
        std::vector<float> rgb; ///< rows from the top
        double seconds = 0;     ///< CPU time of the rendering alone
    };

    /// Starts `python script folder setting`. throws lambent::Error where that fails
    Peer(const std::string& python, const std::string& script, const std::filesystem::path& folder,
         const std::string& setting)
        : name_(std::filesystem::path(script).stem().string() + " " + setting), image_(folder / "peer.f32") {
        const auto start = std::chrono::steady_clock::now();
        int requests[2], answers[2];
        lambent::require(pipe2(requests, O_CLOEXEC) == 0 && pipe2(answers, O_CLOEXEC) == 0, "no pipes left");
        process_ = fork();
        lambent::require(process_ >= 0, "no further process can be started");
        if (process_ == 0) {
            dup2(requests[0], 0);
            dup2(answers[1], 1);
            execlp(python.c_str(), python.c_str(), script.c_str(), folder.c_str(), setting.c_str(), nullptr);
            _exit(127);
        }
        close(requests[0]);
        close(answers[1]);
        to_ = requests[1];
        from_ = answers[0];
        std::signal(SIGPIPE, SIG_IGN);
        try {
            read_answer();
        } catch (...) {
            finish();
            throw;
        }
        const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
        first_image_s_ = passed.count();
    }
    Peer(const Peer&) = delete;
    Peer& operator=(const Peer&) = delete;
    ~Peer() { finish(); }

    /// Wall clock from its start to the first image, of one sample a pixel.
    double first_image_s() const { return first_image_s_; }
    /// The most memory that it had up to its last answer.
    double peak_mib() const { return peak_mib_; }

    /// throws lambent::Error where the peer has ended
    Answer render(std::uint64_t spp, std::uint32_t seed) {
        const std::string request = std::to_string(spp) + " " + std::to_string(seed) + " " + image_.string() + "\n";
        lambent::require(write(to_, request.data(), request.size()) == ssize_t(request.size()), died());
        Answer answer = read_answer();
        answer.rgb.resize(std::filesystem::file_size(image_) / sizeof(float));
        std::ifstream(image_, std::ios::binary)
            .read(reinterpret_cast<char*>(answer.rgb.data()), std::streamsize(answer.rgb.size() * sizeof(float)));
        return answer;
    }

private:
    void finish() {
        close(to_); // ends it
        close(from_);
        waitpid(process_, nullptr, 0);
    }
    Answer read_answer() {
        std::string line;
        for (char c = 0; read(from_, &c, 1) == 1 && c != '\n';) line += c;
        lambent::require(!line.empty(), died());
        const Row row = parse(line);
        peak_mib_ = number(row, "peak_mib");
        return {{}, number(row, "seconds")};
    }
    std::string died() const { return name_ + " ended; its reasons are above"; }

    std::string name_;
    std::filesystem::path image_;
    pid_t process_ = -1;
    int to_ = -1, from_ = -1;
    double first_image_s_ = 0, peak_mib_ = 0;
};
