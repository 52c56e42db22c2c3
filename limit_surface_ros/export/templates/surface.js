// SPDX-License-Identifier: Apache-2.0
//
// @TITLE@
//
// Written by `export_surface --to js`: the maps of one limit surface, for browsers and Node.js.
// Wrenches are [fx, fy, tau_z] in N, N, N m, applied to the body; twists are [vx, vy, omega_z] in
// m/s, m/s, rad/s; both about the reference point of the model, in its frame.
//
//     import { surface } from "./@MODULE@.mjs";
//     surface.twistOfWrench([1.0, 0.2, 0.03]);   // null where there is no answer

@ENGINE@

export const surface = makeSurface(@MODEL@);
