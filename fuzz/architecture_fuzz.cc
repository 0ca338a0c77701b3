#include "fuzz.h"
#include "likeness/avatar/architecture.h"
#include "likeness/avatar/tensor_registry.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  Architecture architecture;
  try {
    architecture = ArchitectureFromJson(std::string(bytes));
    LIKENESS_CHECK(ArchitectureFromJson(ArchitectureToJson(architecture)) == architecture);
    architecture.Check();
  } catch (const Error&) {
    return;
  }
  LIKENESS_CHECK(ParameterCount(architecture) > 0);
}

}  // namespace likeness
