// grouser-gpu-law-check: drives random contacts through a few steps of every
// compiled law combination, and of every legal combination on the generic path, on
// the device and on the host, from the same headers, and compares. Exit code 0
// when every force agrees to 1e-5 of the largest of its laws, 1 when not, 2
// without a GPU.
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "dem_offline/engine/laws/contact_model.h"

namespace {

using namespace grouser::dem;

constexpr int kContacts = 1 << 18, kSteps = 8;
constexpr float kDt = 1e-6f;

/// What evaluates a contact: a law combination, or any laws at run time.
template <class R>
struct Fixed {
  typename R::Params params;
  __host__ __device__ ContactResult operator()(const ContactGeometry& g, float* words) const {
    return R::Evaluate(params, g, words, kDt);
  }
};
struct Any {
  WordLayout at;
  PairParams params;
  __host__ __device__ ContactResult operator()(const ContactGeometry& g, float* words) const {
    return EvaluateGeneric(at, params, g, words, kDt);
  }
};

/// Runs one contact; the overlap drifts with the approach.
template <class Law>
__host__ __device__ Vec3f Run(const Law& law, ContactGeometry g) {
  float words[kMaxHistoryWords] = {};
  Vec3f force = {0.0f, 0.0f, 0.0f};
  for (int s = 0; s < kSteps; ++s) {
    force = law(g, words).force;
    g.overlap = Max(g.overlap - kDt * Dot(g.v_rel, g.n), 1e-9f);
    g.v_rel = 0.9f * g.v_rel;
  }
  return force;
}

template <class Law>
__global__ void Evaluate(const ContactGeometry* in, Vec3f* out, int n, Law law) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < n) out[i] = Run(law, in[i]);
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

PairParams SomeParams(const LawChoice& laws) {
  ContactProperties f;
  f.rolling_friction = 0.3;
  f.surface_energy_j_per_m2 = 0.05;
  LawSettings settings;
  SettingsOf<HertzOdenMartins>(settings).damping_kg_per_m_s = 1e4;
  return OneMaterial({1e8, 0.3}, f, laws, settings).Table()[0];
}

/// Compares the first n contacts; false where device and host differ too much.
template <class Law>
bool Agrees(const std::string& name, const Law& law, int n,
            const std::vector<ContactGeometry>& contacts, const ContactGeometry* in, Vec3f* out) {
  Evaluate<<<n / 256, 256>>>(in, out, n, law);
  std::vector<Vec3f> got(n);
  if (!Ok(cudaMemcpy(got.data(), out, n * sizeof(Vec3f), cudaMemcpyDeviceToHost), name.c_str())) {
    return false;
  }
  double worst = 0, largest = 0;
  bool finite = true;
  for (int i = 0; i < n; ++i) {
    const Vec3f host = Run(law, contacts[i]), d = host - got[i];
    const double off = std::sqrt(Dot(d, d)), size = std::sqrt(Dot(host, host));
    finite = finite && std::isfinite(off) && std::isfinite(size);
    worst = std::fmax(worst, off);
    largest = std::fmax(largest, size);
  }
  std::printf("%s: %d contacts, largest force %.4g N, largest difference %.3g N\n", name.c_str(), n,
              largest, worst);
  return finite && worst <= 1e-5 * largest;
}

template <class... R>
bool CombinationsAgree(CombinationList<R...>, const std::vector<ContactGeometry>& contacts,
                       const ContactGeometry* in, Vec3f* out) {
  int combination = 0;
  bool ok = true;
  ((ok = Agrees(CombinationName(combination++), Fixed<R>{R::From(SomeParams(ChoiceOf<R>()))},
                kContacts, contacts, in, out) &&
         ok),
   ...);
  return ok;
}

bool GenericAgrees(const std::vector<ContactGeometry>& contacts, const ContactGeometry* in,
                   Vec3f* out) {
  bool ok = true;
  for (int n = 0; n < NormalLaws::kSize; ++n) {
    for (int t = 0; t < TangentialLaws::kSize; ++t) {
      for (int r = 0; r < RollingLaws::kSize; ++r) {
        for (int c = 0; c < CohesionLaws::kSize; ++c) {
          const LawChoice laws = {n, t, r, c};
          if (!WhyIllegal(laws).empty()) continue;
          const Any any = {LayoutOf(laws), SomeParams(laws)};
          ok = Agrees(Describe(laws), any, 1 << 12, contacts, in, out) && ok;
        }
      }
    }
  }
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
  const bool combinations = CombinationsAgree(CompiledCombinations{}, contacts, in, out);
  const bool ok = GenericAgrees(contacts, in, out) && combinations;
  cudaFree(in);
  cudaFree(out);
  return ok ? 0 : 1;
}
