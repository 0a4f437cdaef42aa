//! Every declared value of a vehicle's file and a scenario's, changed in turn: the file keeps it, a campaign's
//! fingerprint tells it, the firmware's image and a station have it, and a flight responds, or it is listed here why
//! not. A field that no key of a file changes fails, too.
