#pragma once

#include <string>
#include <vector>

#include "held_out.hpp"
#include "method_table.hpp"

namespace sarfocus::autofocus::detail {

/// A method on parts of the image.
struct ScoredMethod {
    const Method* method = nullptr;
    MethodTrial trial;
    std::vector<double> gain_db;  ///< of every held-out point; empty where it was not scored

    /// Its gain is above its noise, and the energy round the points does not spread.
    [[nodiscard]] bool helps() const;
};

struct HeldOutScores {
    std::vector<ScoredMethod> methods;  ///< in the order in which they are trusted
    bool decides = false;               ///< false: too few points are left over to judge by
    std::string how;                    ///< a few words on what was scored
};

/// Every method on one set of range gates, judged by the strong points of the other, both ways. Exceptions of a method for a part of the
/// image become its reason; Cancelled and those of memory pass.
[[nodiscard]] HeldOutScores score_held_out(const Subject& subject, const std::vector<const Method*>& methods, const CellSize& cell,
                                           const Execution& execution);

/// The methods that help, in the order in which to try them: the best first, or the first of those as good within the noise; then the
/// next. Writes the reasons of the others.
[[nodiscard]] std::vector<ScoredMethod*> ranked(HeldOutScores& scores);

}  // namespace sarfocus::autofocus::detail
