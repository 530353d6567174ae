pub mod features;
pub mod ladder;
pub mod rank;
pub mod worker;
pub mod descent;
