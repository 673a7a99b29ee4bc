#pragma once

#include <string>
#include <vector>

namespace grouser::surrogate {

/// What became of one file.
struct Migration {
  std::string file;
  std::string result;         ///< "current", "converted" or "failed"
  std::string text;           ///< for people: where the new file and the original are, or the cause
  std::string before, after;  ///< digest of a model, SHA-256 of a run file; where converted
};

/// Converts a file of an earlier version to today's form: a model file (*.model), a run file
/// (*.run.h5), a campaign or its summary (campaign.json, *.runs.json); by content, whatever the
/// name. `out`: folder to write the new file to, with the same name (one named by its digest: by
/// the new one); a file that is current is copied. Empty: in place, the original kept as
/// FILE.before, which is on the disk before anything is replaced. Nothing else is overwritten.
/// Whatever is wrong becomes a result "failed"; the file is then as it was.
Migration Migrate(const std::string& file, const std::string& out);

std::string MigrationText(const std::vector<Migration>& files);
std::string MigrationJson(const std::vector<Migration>& files);

}  // namespace grouser::surrogate
