// Tests of storage that any memory must pass run with memories on a server in this program, too.
#include <gtest/gtest.h>

#include "panonav_fleet/postgresql_memories.hpp"

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  panonav::fleet::register_postgresql_memories();
  return RUN_ALL_TESTS();
}
