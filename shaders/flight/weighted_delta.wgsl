// Slot @flight: weighted delta tracking: real with probability μ/(μ + |majorant − μ|). With coloured extinction its
// probabilities are those of spectral tracking with history.
//!use flight/spectral_history
