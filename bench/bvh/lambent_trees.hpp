#pragma once
#include "contender.hpp"
#include <lambent/bvh/bvh.hpp>
#include <memory>
#include <vector>

/// Which of our trees run.
struct LambentModes {
    bool in_double = false, compact = false, batch = false;
};

struct LambentTrees {
    std::shared_ptr<const lambent::Bvh> tree; ///< as users get it by default
    Contender reference;                      ///< the tree in double, against which every answer is checked
    std::vector<Contender> contenders;
};

/// Builds our trees over the soup, which must outlive them.
LambentTrees lambent_trees(const Soup& soup, const LambentModes& modes);

BuildCost build_lambent(const Soup& soup, lambent::BuildQuality quality);
