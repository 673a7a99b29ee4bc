#pragma once

#include <filesystem>

namespace grouser::os {

/// The folder with what programs read besides their own arguments (its surrogate/ has tables of
/// soils, vehicles, pairs): PREFIX/share/grouser where `program` is PREFIX/bin/NAME of an
/// installation, the checkout where it is CHECKOUT/build/PRESET/bin/NAME. Empty where neither has
/// surrogate/soils.
std::filesystem::path RootOf(const std::filesystem::path& program);
/// Of this process's program.
std::filesystem::path RootOfProgram();

}  // namespace grouser::os
