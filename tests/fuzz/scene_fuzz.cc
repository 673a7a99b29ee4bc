// Any text is a scene or refused with an InputError; nothing else comes out.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "dem_offline/scenes/scene_yaml.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using grouser::campaign::YamlSection;
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const auto scene = grouser::campaign::ReadScene(YamlSection::OfText(text, "fuzz"));
    // What was accepted keeps what the reader promises.
    if (!(scene.wheel().radius_m() > 0) || !std::isfinite(scene.wheel().radius_m())) std::abort();
    if (scene.soil().grains().sizes().empty()) std::abort();
    if (scene.rig().width_bins() < 1) std::abort();
  } catch (const grouser::campaign::InputError&) {  // refused: as it should be
  }
  return 0;
}
