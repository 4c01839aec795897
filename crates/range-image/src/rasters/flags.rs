use bitflags::bitflags;

bitflags! {
    /// Why a pixel should not be trusted. A flagged pixel keeps its value; dropping it is the consumer's choice.
    ///
    /// The bits are those written to files as `u16`.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct Flags: u16 {
        /// At least one raw sample reached the sensor's saturation value.
        const SATURATED = 1;
        /// The amplitude is below the chosen threshold.
        const LOW_AMPLITUDE = 1 << 1;
        /// The pixel's footprint covers several distances (depth edge).
        const MIXED_PIXEL = 1 << 2;
        /// The scene or the camera moved during the exposure.
        const MOTION = 1 << 3;
        /// Light that came by more than one way is suspected.
        const MULTIPATH = 1 << 4;
        /// The number of whole ambiguity intervals is not certain.
        const UNWRAP_UNSURE = 1 << 5;
        /// Range, amplitude or position lies outside the span the error model was fitted in.
        const OUTSIDE_SPAN = 1 << 6;
        /// No value: the sensor gave none or it was not finite.
        const NO_DATA = 1 << 7;
        /// Light of another camera in the same band, or light that flickers, disturbs the samples.
        const INTERFERENCE = 1 << 8;
    }
}

impl Flags {
    /// Each single flag with the name used in reports and files.
    pub const NAMED: [(Self, &'static str); 9] = [
        (Self::SATURATED, "saturated"),
        (Self::LOW_AMPLITUDE, "low_amplitude"),
        (Self::MIXED_PIXEL, "mixed_pixel"),
        (Self::MOTION, "motion"),
        (Self::MULTIPATH, "multipath"),
        (Self::UNWRAP_UNSURE, "unwrap_unsure"),
        (Self::OUTSIDE_SPAN, "outside_span"),
        (Self::NO_DATA, "no_data"),
        (Self::INTERFERENCE, "interference"),
    ];
}
