#include "surrogate/accuracy_benchmark/kriging.h"

#include <cmath>
#include <openturns/Basis.hxx>
#include <openturns/ConstantBasisFactory.hxx>
#include <openturns/KrigingAlgorithm.hxx>
#include <openturns/Log.hxx>
#include <openturns/MaternModel.hxx>
#include <stdexcept>
#include <string>

#include "surrogate/fit/residual_field.h"
#include "surrogate/fit/trained.h"

namespace grouser::surrogate {
namespace {

double SignOf(int output, double x, double y) {
  const ResidualTable::Parity parity = ResidualTable::ParityOf(output);
  return (parity.x < 0 ? x : 1) * (parity.y < 0 ? y : 1);
}

/// As many of them as asked for: the last is ln speed.
OT::Point Inputs(const FieldPoint& p, double log_speed, int dimensions, double mirror_x,
                 double mirror_y) {
  const double all[] = {mirror_x * p.direction[0], mirror_y * p.direction[1],
                        mirror_x * p.direction[2], p.log_load, log_speed};
  OT::Point x(dimensions);
  for (int i = 0; i < dimensions; ++i) x[i] = all[i];
  return x;
}

}  // namespace

struct Kriging::Fits {
  std::array<OT::KrigingResult, kOutputs> of;
  int dimensions;
};

Kriging::Kriging(const std::vector<Sample>& rows, const std::array<double, kOutputs>& patch,
                 double radius_m)
    : fits_(std::make_unique<Fits>()), patch_(patch), radius_(radius_m) {
  // A length along an axis on which nothing changes cannot be found.
  fits_->dimensions = SpeedAxisOf(rows, radius_m, 1).present() ? 5 : 4;
  OT::Log::Show(OT::Log::NONE);
  for (const int o : kPredicted) {
    OT::Sample x(0, fits_->dimensions), y(0, 1);
    OT::Point noise;
    for (const Sample& row : rows) {
      const Canonical state = row.state();
      const FieldPoint point = MakeFieldPoint(state, row.load_n);
      const double scale = OutputScale(o, row.load_n, radius_m);
      const double own =
          SignOf(o, state.sign_x == 0 ? 1 : state.sign_x, state.sign_y == 0 ? 1 : state.sign_y);
      for (const double mx : {1.0, -1.0}) {
        for (const double my : {1.0, -1.0}) {
          x.add(Inputs(point, std::log(state.speed), fits_->dimensions, mx, my));
          y.add(OT::Point(1, own * SignOf(o, mx, my) * row.mean[o] / scale));
          const double sd = std::hypot(row.standard_error[o] / scale, patch[o]);
          noise.add(std::max(sd * sd, 1e-10));
        }
      }
    }
    try {
      const OT::MaternModel covariance(OT::Point(fits_->dimensions, 0.7), OT::Point(1, 0.3), 2.5);
      OT::KrigingAlgorithm algorithm(x, y, covariance,
                                     OT::ConstantBasisFactory(fits_->dimensions).build());
      algorithm.setNoise(noise);
      algorithm.run();
      fits_->of[o] = algorithm.getResult();
    } catch (const OT::Exception& error) {
      throw std::runtime_error(std::string("kriging of ") + kOutputFields[o].name + ": " +
                               error.what());
    }
  }
}

Kriging::~Kriging() = default;

Answer Kriging::At(const Sample& row) const {
  const Canonical state = row.state();
  const FieldPoint point = MakeFieldPoint(state, row.load_n);
  const OT::Point x = Inputs(point, std::log(state.speed), fits_->dimensions, 1, 1);
  Answer answer{};
  for (const int o : kPredicted) {
    const double scale = OutputScale(o, row.load_n, radius_);
    answer.value[o] = scale * fits_->of[o].getConditionalMean(x)[0];
    const double variance = fits_->of[o].getConditionalMarginalVariance(x);
    answer.half_width[o] =
        kTwoSided90 * scale * std::sqrt(std::max(variance, 0.0) + patch_[o] * patch_[o]);
  }
  answer.value[kFz] = row.load_n;
  ApplyMirrors(state, &answer.value);
  return answer;
}

}  // namespace grouser::surrogate
