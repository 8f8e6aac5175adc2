//! Plants, scenarios and traces around an emitted controller.
