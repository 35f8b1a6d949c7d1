#include "analysis/residual/search/group_steps.h"

#include "analysis/residual/search/fits.h"
#include "analysis/residual/search/in_groups.h"
#include "analysis/residual/search/older_effects.h"

#include <optional>
#include <utility>

namespace tunnelrig {

bool let_groups_differ(SearchState& state, std::size_t t, bool before_others) {
  std::optional<InGroups> own = let_differ(state.data, state.found, t, before_others);
  if (!own) return false;
  state.data.set_observations(std::move(own->observations));
  state.found.make_newest(t, std::move(own->fit));
  return true;
}

bool let_any_differ(SearchState& state) {
  const std::vector<Accepted>& accepted = state.found.accepted;
  std::size_t t = accepted.size();
  while (t > 0 && !let_groups_differ(state, t - 1, false)) --t;
  if (t == 0) return false;
  // What was found later may have been what the groups differ by.
  for (std::size_t k = accepted.size(); k-- > t - 1;) {
    const Term& term = accepted[k].term;
    if (term.per_group || term.effect->theory_only) continue;
    const JointFit without = fit_without(state.data, state.found.fit, k);
    if (!is_still_found(state.data, state.found, term, without, state.questions))
      state.found.drop(k, without);
  }
  return true;
}

bool accept_in_groups(SearchState& state, const Term& way, double p) {
  std::optional<InGroups> own = new_in_groups(state.data, state.found, way);
  if (!own) return false;
  state.data.set_observations(std::move(own->observations));
  state.found.accept(std::move(own->fit), p);
  return true;
}

}  // namespace tunnelrig
