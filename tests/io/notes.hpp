#pragma once
#include <algorithm>
#include <lambent/scene/scene.hpp>
#include <string>

namespace lambent_test {

/// Does a note of the loader's hold `text`?
inline bool noted(const lambent::Scene<float>& scene, const std::string& text) {
    return std::any_of(scene.notes.begin(), scene.notes.end(),
                       [&](const std::string& note) { return note.find(text) != std::string::npos; });
}

} // namespace lambent_test
