// grouser-gpu-law-check: drives random contacts through a few steps of every
// recipe of the menu on the device and on the host, from the same headers, and
// compares. Exit code 0 when every force agrees to 1e-5 of the largest of its
// recipe, 1 when not, 2 without a GPU.
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "dem_offline/engine/laws/contact_model.h"

namespace {

using namespace grouser::dem;

constexpr int kContacts = 1 << 18, kSteps = 8;
constexpr float kDt = 1e-6f;

/// Runs one contact; the overlap drifts with the approach.
template <class R>
__host__ __device__ Vec3f Run(const typename R::Params& params, ContactGeometry g) {
  float words[R::kWords] = {};
  Vec3f force = {0.0f, 0.0f, 0.0f};
  for (int s = 0; s < kSteps; ++s) {
    force = R::Evaluate(params, g, words, kDt).force;
    g.overlap = Max(g.overlap - kDt * Dot(g.v_rel, g.n), 1e-9f);
    g.v_rel = 0.9f * g.v_rel;
  }
  return force;
}

template <class R>
__global__ void Evaluate(const ContactGeometry* in, Vec3f* out, int n, typename R::Params params) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < n) out[i] = Run<R>(params, in[i]);
}

std::vector<ContactGeometry> RandomContacts() {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> u(-1, 1);
  std::vector<ContactGeometry> out(kContacts);
  for (ContactGeometry& g : out) {
    const Vec3f a = {u(random), u(random), u(random) + 2};
    g.n = (1 / std::sqrt(Dot(a, a))) * a;
    g.overlap = 1e-5f * (1.5f + u(random));
    g.v_rel = {u(random), u(random), u(random)};
    g.w_rel = {20 * u(random), 20 * u(random), 20 * u(random)};
    g.w_own = 0.5f * g.w_rel;
    g.r_own = g.r_other = 4e-3f;
    g.r_eff = 2e-3f;
    g.m_own = 8e-4f;
    g.m_eff = 4e-4f;
    g.roll_inertia = 1e-8f;
    g.k_old = 0;
  }
  return out;
}

bool Ok(cudaError_t e, const char* what) {
  if (e != cudaSuccess) std::fprintf(stderr, "%s: %s\n", what, cudaGetErrorString(e));
  return e == cudaSuccess;
}

/// Compares one recipe; false where device and host differ too much.
template <class R>
bool Agrees(int recipe, const std::vector<ContactGeometry>& contacts, const ContactGeometry* in,
            Vec3f* out) {
  Interface f;
  f.rolling_friction = 0.3;
  f.surface_energy_j_per_m2 = 0.05;
  const auto table = OneMaterial({1e8, 0.3}, f, ChoiceOf<R>()).Table();
  const typename R::Params params = R::From(table[0]);
  Evaluate<R><<<kContacts / 256, 256>>>(in, out, kContacts, params);
  std::vector<Vec3f> got(kContacts);
  if (!Ok(cudaMemcpy(got.data(), out, kContacts * sizeof(Vec3f), cudaMemcpyDeviceToHost),
          RecipeName(recipe))) {
    return false;
  }
  double worst = 0, largest = 0;
  for (int i = 0; i < kContacts; ++i) {
    const Vec3f host = Run<R>(params, contacts[i]), d = host - got[i];
    worst = std::fmax(worst, std::sqrt(Dot(d, d)));
    largest = std::fmax(largest, std::sqrt(Dot(host, host)));
  }
  std::printf("%-20s %d contacts: largest force %.4g N, largest difference %.3g N\n",
              RecipeName(recipe), kContacts, largest, worst);
  return std::isfinite(largest) && worst <= 1e-5 * largest;
}

template <class... R>
bool AllAgree(RecipeList<R...>, const std::vector<ContactGeometry>& contacts,
              const ContactGeometry* in, Vec3f* out) {
  int recipe = 0;
  bool ok = true;
  ((ok = Agrees<R>(recipe++, contacts, in, out) && ok), ...);
  return ok;
}

}  // namespace

int main() {
  const std::vector<ContactGeometry> contacts = RandomContacts();
  ContactGeometry* in = nullptr;
  Vec3f* out = nullptr;
  if (!Ok(cudaMalloc(&in, kContacts * sizeof(ContactGeometry)), "no usable GPU") ||
      !Ok(cudaMalloc(&out, kContacts * sizeof(Vec3f)), "device memory")) {
    return 2;
  }
  cudaMemcpy(in, contacts.data(), kContacts * sizeof(ContactGeometry), cudaMemcpyHostToDevice);
  const bool ok = AllAgree(Recipes{}, contacts, in, out);
  cudaFree(in);
  cudaFree(out);
  return ok ? 0 : 1;
}
