//! Changes every declared value of a vehicle file and of a scenario file in turn. The file keeps the value, a
//! campaign's fingerprint changes, the firmware's image and a station have the value, and a flight responds, or a list
//! here says why not. A field that no key of a file changes fails, too.
