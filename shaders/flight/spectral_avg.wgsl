// Slot @flight: spectral tracking, events chosen by the mean of their channels (Kutz et al. 2017).
//!use flight/weighted

fn flight_measure(weight: Spectrum, event: Spectrum) -> f32 {
    return spectrum_mean(abs(event));
}
