// SPDX-License-Identifier: Apache-2.0
//
// Runs the controller at 1 kHz for a while and prints the longest step of all.

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "push_controller.hpp"

int main(int count, char** argument) {
    using Clock = std::chrono::steady_clock;
    const int steps = count > 1 ? std::atoi(argument[1]) : 1000;
    push::PushController controller(0.05, 0.5);
    double longest = 0.0;
    int sliding = 0;
    auto next = Clock::now();
    for (int i = 0; i < steps; ++i) {
        next += std::chrono::milliseconds(1);
        std::this_thread::sleep_until(next);
        const double t = 1e-3 * i;
        const push::Vector wrench{4.0 * std::sin(3.0 * t), 0.3, 0.05 * std::cos(7.0 * t)};
        const auto start = Clock::now();
        const push::Command command = controller.step(wrench, 1e-3);
        longest = std::fmax(longest, std::chrono::duration<double>(Clock::now() - start).count());
        sliding += command.load_factor >= 1.0;
        if (!command.certain) {
            std::printf("no answer at step %d\n", i);
            return 1;
        }
    }
    std::printf("%d steps, %d sliding, longest %.1f us\n", steps, sliding, 1e6 * longest);
    return 0;
}
