// Slot @flight: spectral tracking, events chosen by their greatest channel (Kutz et al. 2017).
//!use flight/weighted

fn flight_measure(weight: Spectrum, event: Spectrum) -> f32 {
    return spectrum_max(event);
}
