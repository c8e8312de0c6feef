#pragma once
#include "contender.hpp"
#include <memory>
#include <string>
#include <vector>

/// Embree 3 or 4, loaded when the program runs: of both at once, of any version, without their headers.
class EmbreeLibrary {
public:
    /// A path, or a name that the system's loader finds.
    /// throws lambent::Error where there is none, or one of another version than `major`
    EmbreeLibrary(const std::string& path, int major);

    std::string name() const { return major_ == 3 ? "embree" : "embree4"; }
    const std::string& version() const { return version_; } ///< as "3.13.5"

private:
    friend class EmbreeScene;
    struct Functions;
    std::shared_ptr<const Functions> functions_;
    int major_;
    std::string version_;
};

/// As in Embree's API. Low is its Morton builder, high has spatial splits.
enum class EmbreeQuality { low, medium, high };

/// Ray by ray in the tree of quality high, Embree's fastest that is not made robust; and with `packets` 8 and 16
/// rays a call as well, with the flag for coherent rays where they are.
std::vector<Contender> embree_contenders(const EmbreeLibrary& library, const Soup& soup, bool packets);

/// Bytes are those that Embree still holds after the build, by its own count, without the caller's buffers.
BuildCost build_embree(const EmbreeLibrary& library, const Soup& soup, EmbreeQuality quality);
