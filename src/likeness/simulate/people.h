// Several people in the same capture: who performs the same, before the same rig and lights, so that what differs is
// identity.

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "likeness/simulate/simulate.h"

namespace likeness {

// Seeds of people that differ as much as `count` (2 to 64) of them can in sex, age, ancestry, skin, hair and build: of
// a thousand people, the one who is least like those already chosen comes next. The same for the same seed; more people
// begin with those that fewer have.
std::vector<uint64_t> ChoosePeople(int count, uint64_t seed);

struct Person {
  std::string name;  // "person_1", ...: the folder in options.out, a capture of its own
  std::string head;  // "human:312"
  SimulateResult result;
};

// Makes the captures one after another, as Simulate does. `options.head` says whom to choose: "human:SEED" people, or
// "procedural:SEED" heads. All cameras are the same: they are made for the largest of the heads.
std::vector<Person> SimulatePeople(const SimulateOptions& options, int count);

}  // namespace likeness
