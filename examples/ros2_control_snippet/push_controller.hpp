// SPDX-License-Identifier: Apache-2.0
//
// The core of a controller that pushes a body: what its update() does at 1 kHz. In ros2_control,
// construct it in on_configure, call `step` from update(time, period) with the wrench of the
// force-torque sensor moved to the body's reference point, and write what it returns to the command
// interfaces. It allocates nothing and throws nothing.
//
// box.hpp is made by: export_surface box.yaml --to cpp -o box.hpp

#pragma once

#include <algorithm>
#include <cmath>

#include "box.hpp"

namespace push {

namespace body = limit_surface_box;
using Vector = body::Vector<double>;

struct Command {
    Vector twist{};      // Of the body [m/s, m/s, rad/s]: zero while it sticks.
    double load_factor;  // From 1 on the body slides.
    bool certain;        // Whether the maps had an answer.
};

// Limits the motion of a pushed body: how fast its most moved part goes, and how it speeds up.
class PushController {
public:
    PushController(double speed, double acceleration) noexcept
        : speed_(speed), acceleration_(acceleration) {}

    Command step(const Vector& wrench, double period) noexcept {
        Command command{{}, 0.0, true};
        Vector direction{};
        const auto found = body::load_factor(wrench, command.load_factor);
        const bool slides = found == body::Status::ok && command.load_factor >= 1.0;
        command.certain = found == body::Status::ok;
        if (slides) {
            command.certain = body::twist_of_wrench(wrench, direction) == body::Status::ok;
        }
        const double wanted = slides && command.certain ? speed_ : 0.0;
        const double most = acceleration_ * period;
        now_ += std::clamp(wanted - now_, -most, most);
        for (std::size_t i = 0; i < 3; ++i) {
            command.twist[i] = now_ * direction[i];
        }
        return command;
    }

private:
    double speed_, acceleration_, now_ = 0.0;
};

}  // namespace push
