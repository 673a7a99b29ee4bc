#include "dem_offline/campaign/schedule.h"

#include <algorithm>
#include <cmath>

namespace grouser::campaign {

double ExpectedLength(const v1alpha1::TestState& state) {
  return (1.0 + std::abs(state.slip()) + std::abs(std::sin(state.attack_angle_rad()))) /
         std::sqrt(state.load_n());
}

std::vector<int> ScheduleOrder(const v1alpha1::Campaign& campaign) {
  std::vector<int> train, others;
  for (int i = 0; i < campaign.runs_size(); ++i) {
    (campaign.runs(i).role() == v1alpha1::RUN_ROLE_TRAIN ? train : others).push_back(i);
  }
  const auto longer = [&campaign](int a, int b) {
    return ExpectedLength(campaign.runs(a).state()) > ExpectedLength(campaign.runs(b).state());
  };
  std::stable_sort(train.begin(), train.end(), longer);
  std::stable_sort(others.begin(), others.end(), longer);
  const double span = 2.0 / 3.0 * static_cast<double>(train.size());
  std::vector<int> order;
  std::size_t next = 0;
  for (std::size_t i = 0; i < train.size(); ++i) {
    const double due = static_cast<double>(i + 1) / span * static_cast<double>(others.size());
    while (next < others.size() && static_cast<double>(next) < due) order.push_back(others[next++]);
    order.push_back(train[i]);
  }
  while (next < others.size()) order.push_back(others[next++]);
  return order;
}

}  // namespace grouser::campaign
