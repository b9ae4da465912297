#include "panonav/core/executor.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

TEST(Executor, CallsEveryIndexOnceOnAnyNumberOfThreads) {
  for (const int threads : {1, 2, 3, 8}) {
    Executor executor(threads);
    EXPECT_EQ(executor.threads(), threads);
    for (const std::size_t count :
         {std::size_t{1}, std::size_t{7}, std::size_t{64}, std::size_t{1001}}) {
      for (const std::size_t chunk :
           {std::size_t{1}, std::size_t{3}, std::size_t{64}, std::size_t{5000}}) {
        std::vector<std::atomic<int>> calls(count);
        executor.for_each_chunk(count, chunk,
                                [&](std::size_t begin, std::size_t end, std::size_t number) {
                                  EXPECT_EQ(begin, number * chunk);
                                  EXPECT_EQ(end, std::min(count, begin + chunk));
                                  for (std::size_t i = begin; i < end; ++i) ++calls[i];
                                });
        for (const auto& c : calls) ASSERT_EQ(c.load(), 1);
      }
    }
  }
}

// Runs where the system starts only `processes` processes and threads for the user. Gives 0 when
// the executor of 64 threads has fewer and still computes `expected`.
int sum_with_few_threads(rlim_t processes, std::size_t expected) {
  constexpr uid_t nobody = 65534;
  if (geteuid() == 0 && setuid(nobody) != 0) return 2;
  const rlimit limit{processes, processes};
  if (setrlimit(RLIMIT_NPROC, &limit) != 0) return 2;
  Executor executor(64);
  if (executor.threads() >= 64) return 3;
  std::vector<std::size_t> sums(100);
  executor.for_each_chunk(1000, 10, [&](std::size_t begin, std::size_t end, std::size_t number) {
    for (std::size_t i = begin; i < end; ++i) sums[number] += i * i;
  });
  std::size_t sum = 0;
  for (const std::size_t s : sums) sum += s;
  return sum == expected ? 0 : 4;
}

TEST(Executor, GoesOnWithTheThreadsThatCouldBeStarted) {
  std::size_t expected = 0;
  for (std::size_t i = 0; i < 1000; ++i) expected += i * i;
  for (const rlim_t processes : {rlim_t{1}, rlim_t{8}}) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) _exit(sum_with_few_threads(processes, expected));
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status)) << "ended by signal " << WTERMSIG(status);
    if (WEXITSTATUS(status) == 2) GTEST_SKIP() << "the number of threads cannot be limited here";
    EXPECT_EQ(WEXITSTATUS(status), 0);
  }
}

TEST(Executor, AnEmptyLoopCallsNothing) {
  Executor executor(2);
  executor.for_each_chunk(0, 4, [](std::size_t, std::size_t, std::size_t) { FAIL(); });
}

// A floating-point reduction is the test of determinism: its bits depend on the order of adding.
double chunked_sum(int threads) {
  constexpr std::size_t count = 10'000;
  constexpr std::size_t chunk = 37;
  Executor executor(threads);
  std::vector<double> partial((count + chunk - 1) / chunk, 0.0);
  executor.for_each_chunk(count, chunk,
                          [&](std::size_t begin, std::size_t end, std::size_t number) {
                            Random random(9, number);
                            for (std::size_t i = begin; i < end; ++i)
                              partial[number] += random.normal() * 1e3;
                          });
  double sum = 0.0;
  for (const double p : partial) sum += p;
  return sum;
}

TEST(Executor, GivesTheSameBitsOnAnyNumberOfThreads) {
  const double expected = chunked_sum(1);
  EXPECT_NE(expected, 0.0);
  for (const int threads : {2, 3, 7}) EXPECT_EQ(chunked_sum(threads), expected);
}

TEST(Executor, ThrowsTheFirstExceptionByChunkNumberAndRunsTheRest) {
  for (const int threads : {1, 2, 4}) {
    Executor executor(threads);
    std::atomic<int> finished = 0;
    try {
      executor.for_each_chunk(100, 1, [&](std::size_t begin, std::size_t, std::size_t) {
        if (begin % 10 == 3) throw std::runtime_error("chunk " + std::to_string(begin));
        ++finished;
      });
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "chunk 3");
    }
    EXPECT_EQ(finished.load(), 90);
  }
}

TEST(Executor, WorksAgainAfterAnException) {
  Executor executor(2);
  EXPECT_THROW(
      executor.for_each_chunk(4, 1, [](std::size_t, std::size_t, std::size_t) { throw 1; }), int);
  std::atomic<int> calls = 0;
  executor.for_each_chunk(10, 3, [&](std::size_t, std::size_t, std::size_t) { ++calls; });
  EXPECT_EQ(calls.load(), 4);
}

TEST(Executor, ManyShortLoopsDoNotHangOrLoseWork) {
  Executor executor(4);
  std::atomic<std::size_t> sum = 0;
  for (int loop = 0; loop < 2000; ++loop) {
    executor.for_each_chunk(
        5, 2, [&](std::size_t begin, std::size_t end, std::size_t) { sum += end - begin; });
  }
  EXPECT_EQ(sum.load(), 10'000U);
}

TEST(Executor, WhatBetweenThrowsEndsALoopAndTheNextOneRuns) {
  for (const int threads : {1, 4}) {
    int checks = 0;
    bool interrupted = true;
    Executor executor(threads, [&] {
      if (++checks >= 3 && interrupted) throw std::runtime_error("the user");
    });
    std::atomic<int> calls = 0;
    const auto work = [&](std::size_t, std::size_t, std::size_t) {
      ++calls;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    };
    EXPECT_THROW(executor.for_each_chunk(1000, 1, work), std::runtime_error);
    EXPECT_LT(calls.load(), 500);
    interrupted = false;
    calls = 0;
    executor.for_each_chunk(20, 1, work);
    EXPECT_EQ(calls.load(), 20);
  }
}

TEST(Executor, RefusesBadNumbers) {
  EXPECT_THROW(Executor(-1), ContractError);
  EXPECT_THROW(Executor(1025), ContractError);
  EXPECT_GE(Executor(0).threads(), 1);
  Executor executor;
  EXPECT_THROW(executor.for_each_chunk(1, 0, [](std::size_t, std::size_t, std::size_t) {}),
               ContractError);
}

}  // namespace
}  // namespace panonav
