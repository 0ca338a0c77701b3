#include "likeness/app/capture_identity.h"

#include "likeness/avatar/conditions.h"
#include "likeness/train/options.h"

namespace likeness {

int CaptureIdentity(const Avatar& avatar, const std::string& name, const std::filesystem::path& capture) {
  if (name.empty() && avatar.identities.size() == 1) return 0;
  return FindIdentity(avatar, name.empty() ? PersonName(capture) : name);
}

}  // namespace likeness
