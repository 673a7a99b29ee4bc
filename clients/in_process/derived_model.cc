// Models made of opened ones: of a similar wheel, of soils of which one is the right one.
#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "clients/in_process/parts.h"
#include "surrogate/model_io/similar_wheel.h"
#include "surrogate/models/mixture_model.h"

namespace grouser {

Model Model::Scaled(double radius_m, double gravity_m_per_s2) const {
  if (!parts_->head && !parts_->file) {
    throw std::invalid_argument("model " + parts_->name +
                                ": a mixture, expected a model of one soil: scale, then mix");
  }
  // From the file's own wheel: what is composed is as good as what is asked for at once.
  const std::shared_ptr<const Parts> file = parts_->file ? parts_->file : parts_;
  const surrogate::Similarity by = surrogate::SimilarityTo(*file->head, radius_m, gravity_m_per_s2);
  auto parts = std::make_shared<Parts>(*file);
  parts->file = file;
  parts->evaluator = surrogate::MakeScaled(*file->head, file->evaluator, by);
  parts->radius_m = radius_m;
  parts->width_m *= by.length;
  parts->gravity_m_per_s2 = gravity_m_per_s2;
  parts->domain.load_min_n *= by.Force();
  parts->domain.load_max_n *= by.Force();
  parts->domain.speed_m_per_s *= by.Speed();
  parts->as_selectable.form = surrogate::Scaled(file->as_selectable.form, by);
  return Model(std::move(parts));
}

namespace {

// What the states have to be inside of for no model to extrapolate.
Domain Common(const Domain& a, const Domain& b) {
  return {std::max(a.slip_min, b.slip_min),
          std::min(a.slip_max, b.slip_max),
          std::min(a.attack_angle_max_rad, b.attack_angle_max_rad),
          std::max(a.load_min_n, b.load_min_n),
          std::min(a.load_max_n, b.load_max_n),
          std::min(a.speed_m_per_s, b.speed_m_per_s)};
}

// Refuses the next of a mixture where nothing is common to it and to those before.
void CheckShares(const char* what, double low, double high, double next_low, double next_high,
                 const std::string& before, const std::string& next) {
  if (std::max(low, next_low) <= std::min(high, next_high)) return;
  std::ostringstream text;
  text << "mixture: " << what << " of " << next << ": " << next_low << " to " << next_high
       << ", expected some of those of " << before << ", " << low << " to " << high;
  throw std::invalid_argument(text.str());
}

}  // namespace

Model Model::Mixture(std::span<const Model* const> models, std::span<const double> weights) {
  if (models.size() != weights.size()) {
    throw std::invalid_argument("mixture: " + std::to_string(weights.size()) +
                                " weights, expected one for each of " +
                                std::to_string(models.size()) + " models");
  }
  std::vector<surrogate::MixturePart> mixed;
  std::vector<const Parts*> of;
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (models[i] == nullptr || !models[i]->parts_) {
      throw std::invalid_argument("mixture: a model that is not there");
    }
    const Parts& p = *models[i]->parts_;
    mixed.push_back({p.evaluator, weights[i], p.radius_m, p.width_m, p.gravity_m_per_s2});
  }
  const auto evaluator = std::make_shared<surrogate::MixtureModel>(std::move(mixed));
  for (const Model* model : models) {  // those that it kept, in order
    const bool kept = of.size() < evaluator->parts().size() &&
                      evaluator->parts()[of.size()].model == model->parts_->evaluator;
    if (kept) of.push_back(model->parts_.get());
  }
  auto parts = std::make_shared<Parts>(*of.front());
  parts->evaluator = evaluator;
  parts->kind = "mixture";
  parts->digest.clear();
  parts->head = nullptr;
  parts->file = nullptr;
  parts->mixture = true;
  std::vector<surrogate::FormErrors> forms;
  std::vector<double> shares;
  for (std::size_t i = 0; i < of.size(); ++i) {
    const Parts& p = *of[i];
    if (p.interval_level != parts->interval_level) {
      throw std::invalid_argument("mixture: intervals of another level, expected all of one");
    }
    forms.push_back(p.as_selectable.form);
    shares.push_back(evaluator->parts()[i].weight);
    const Domain &a = parts->domain, &b = p.domain;
    CheckShares("loads [N]", a.load_min_n, a.load_max_n, b.load_min_n, b.load_max_n, parts->name,
                p.name);
    CheckShares("slips", a.slip_min, a.slip_max, b.slip_min, b.slip_max, parts->name, p.name);
    parts->domain = Common(a, b);
    parts->has_gradients &= p.has_gradients;
    if (i == 0) continue;
    parts->name += " or " + p.name;
    parts->soil += " or " + p.soil;
  }
  parts->as_selectable.form = surrogate::Mixed(forms, shares);
  return Model(std::move(parts));
}

}  // namespace grouser
