// grouser-gpu-law-check: evaluates the default recipe for random contacts on
// the device and on the host, from the same header, and compares. Exit code 0
// when every force agrees to 1e-5 of the largest, 1 when not, 2 without a GPU.
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "dem_offline/engine/laws/material.h"

namespace {

using grouser::dem::ContactGeometry;
using grouser::dem::ContactHistory;
using grouser::dem::ContactResult;
using grouser::dem::HertzMindlinEpsd;
using grouser::dem::Vec3f;

struct Contact {
  ContactGeometry geometry;
  ContactHistory history;
};

__global__ void Evaluate(const Contact* in, ContactResult* out, int n,
                         HertzMindlinEpsd::Params params, float dt) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < n) out[i] = HertzMindlinEpsd::Evaluate(params, in[i].geometry, in[i].history, dt);
}

std::vector<Contact> RandomContacts(int n) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> u(-1, 1);
  std::vector<Contact> out(n);
  for (Contact& c : out) {
    const Vec3f a = {u(random), u(random), u(random) + 2};
    c.geometry.n = (1 / std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z)) * a;
    c.geometry.overlap = 1e-5f * (1.5f + u(random));
    c.geometry.v_rel = {u(random), u(random), u(random)};
    c.geometry.w_rel = {20 * u(random), 20 * u(random), 20 * u(random)};
    c.geometry.r_eff = 2e-3f;
    c.geometry.m_eff = 4e-4f;
    c.geometry.roll_inertia = 1e-8f;
    c.history = {{1e-2f * u(random), 1e-2f * u(random), 1e-2f * u(random)}, 1e-4f,
                 {1e-5f * u(random), 1e-5f * u(random), 1e-5f * u(random)}};
  }
  return out;
}

bool Ok(cudaError_t e, const char* what) {
  if (e != cudaSuccess) std::fprintf(stderr, "%s: %s\n", what, cudaGetErrorString(e));
  return e == cudaSuccess;
}

}  // namespace

int main() {
  const int n = 1 << 20;
  const float dt = 1e-5f;
  const auto params = grouser::dem::MakeParams({1e7, 0.3}, {1e7, 0.3}, {0.5, 0.5, 0.3});
  const std::vector<Contact> contacts = RandomContacts(n);
  Contact* in = nullptr;
  ContactResult* out = nullptr;
  if (!Ok(cudaMalloc(&in, n * sizeof(Contact)), "no usable GPU") ||
      !Ok(cudaMalloc(&out, n * sizeof(ContactResult)), "device memory")) {
    return 2;
  }
  cudaMemcpy(in, contacts.data(), n * sizeof(Contact), cudaMemcpyHostToDevice);
  Evaluate<<<n / 256, 256>>>(in, out, n, params, dt);
  std::vector<ContactResult> got(n);
  if (!Ok(cudaMemcpy(got.data(), out, n * sizeof(ContactResult), cudaMemcpyDeviceToHost), "kernel")) {
    return 1;
  }
  double worst = 0, largest = 0;
  for (int i = 0; i < n; ++i) {
    const ContactResult host =
        HertzMindlinEpsd::Evaluate(params, contacts[i].geometry, contacts[i].history, dt);
    const Vec3f d = host.force - got[i].force;
    worst = std::fmax(worst, std::sqrt(grouser::dem::Dot(d, d)));
    largest = std::fmax(largest, std::sqrt(grouser::dem::Dot(host.force, host.force)));
  }
  std::printf("%d contacts: largest force %.4g N, largest difference %.3g N\n", n, largest, worst);
  cudaFree(in);
  cudaFree(out);
  return worst <= 1e-5 * largest ? 0 : 1;
}
