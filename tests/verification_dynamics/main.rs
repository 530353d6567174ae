//! Time integration against closed forms and the numbers of reference/verification.json (D1, D2, D4, D5).

mod bodies;
mod motion;
mod oscillator;
mod stability;
