// Stress of a World: what the contacts of each grain add to it.
#include <algorithm>

#include "dem_offline/engine/contact/contact_body.h"
#include "dem_offline/engine/world/passes.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {
namespace {

/// Adds factor times the symmetric part of force (x) arm.
void AddMoment(Vec3d force, Vec3d arm, double factor, ContactMoment* to) {
  for (int k = 0; k < 3; ++k) (*to)[k] += factor * force[k] * arm[k];
  (*to)[3] += factor * 0.5 * (force[0] * arm[1] + force[1] * arm[0]);
  (*to)[4] += factor * 0.5 * (force[0] * arm[2] + force[2] * arm[0]);
  (*to)[5] += factor * 0.5 * (force[1] * arm[2] + force[2] * arm[1]);
}

Vec3d ToDouble(Vec3f v) { return {v.x, v.y, v.z}; }

}  // namespace

std::vector<ContactMoment> World::ContactMoments() const {
  const SimulationState& w = state_;
  std::vector<ContactMoment> out(w.count, ContactMoment{});
  const auto q = w.config.frame.Quantum();
  const ContactModel& model = w.config.contacts;
  const AnyLaws law{model.layout(), w.params.data(), model.materials()};
  w.list.ForEachHistory([&](std::int32_t i, std::int32_t j, const float* words) {
    const Grain &a = w.grains[i], &b = w.grains[j];
    const Separation apart =
        Separate<true>(WrapDiff(a.x, b.x), WrapDiff(a.y, b.y), WrapDiff(a.z, b.z),
                       a.radius + b.radius, q.data(), w.range);
    float copy[kMaxHistoryWords];
    std::copy(words, words + law.Words(), copy);
    ContactEnergy energy;  // a step of no length: springs as they are
    const Side own = SideOf(a), other = SideOf(b);
    const Vec3f force = EvaluateContact(law, own, other, apart, w.range, 0.0f, copy, &energy).force;
    const ContactGeometry g = GeometryOf<true>(own, other, apart, w.range);
    AddMoment(ToDouble(force), ToDouble(g.n), a.radius - 0.5 * g.overlap, &out[i]);
    AddMoment(ToDouble(force), ToDouble(g.n), b.radius - 0.5 * g.overlap, &out[j]);
  });
  for (int b = 0; b < bodies(); ++b) {
    for (const BodyContact& c : ContactsOf(b)) {
      AddMoment(ToDouble(c.force), ToDouble(c.normal), -c.lever_m, &out[c.grain]);
    }
  }
  // A clump is one grain: arms are counted from its centre.
  for (const ClumpEntry& e : w.clumps) {
    const Mat3d turn = MatrixOf(e.state.orientation);
    const auto& members = w.templates[e.state.shape].members;
    for (std::size_t k = 0; k < members.size(); ++k) {
      const std::int32_t i = w.index_of[e.first_id + static_cast<std::int32_t>(k)];
      const GrainLoad& f = w.loads[i];
      AddMoment({f.fx, f.fy, f.fz}, turn * members[k].offset_m, -1, &out[i]);
    }
  }
  return out;
}

}  // namespace grouser::dem
