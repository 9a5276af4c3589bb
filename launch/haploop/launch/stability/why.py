"""Sentences on how the swing of a pushed loop continues, by what was found; the numbers in them are a finding's."""

WHY = {
    "diverged": "The run ended by itself: {detail}.",
    "no contact": "No tick of the window at the end of the run was in contact.",
    "rest": "After a push of {push_N:.3g} N it came to rest, to 5 % within {settles_s:.2g} s.",
    "unmoved": "After a push of {push_N:.3g} N, which did not move it, it stayed at rest.",
    "unfelt": "After a push of {push_N:.3g} N it came to rest within {settles_s:.2g} s except "
    "for {width_um:.3g} µm peak to peak, mostly at {frequency_Hz:.3g} Hz: less than a hand feels{decaying}.",
    "unfelt throughout": "After a push of {push_N:.3g} N it swung by no more than {width_um:.3g} µm peak to peak, "
    "mostly at {frequency_Hz:.3g} Hz: less than a hand feels{decaying}.",
    "forgets": "Pushes of {push_N:.3g} N and of a tenth of it end in the same swing, {width} peak to peak at "
    "{frequency_Hz:.3g} Hz.",
    "lasts": "After pushes of {push_N:.3g} N and of a tenth of it, swings of {width} peak to peak at "
    "{frequency_Hz:.3g} Hz lasted for {watched_s:g} s; the one that may change more grows or decays by no more than "
    "{most_1_s:.2g} 1/s (two standard errors).",
    "decays": "Its swing of {width} peak to peak at {frequency_Hz:.3g} Hz still decays, changing by {rate_1_s:.3g} +- "
    "{error_1_s:.2g} 1/s, and no limit, filter or rounding but the encoder's treats small swings otherwise.",
    "grows": "Its swing grew by {rate_1_s:.3g} +- {error_1_s:.2g} 1/s, at {frequency_Hz:.3g} Hz, as long as it was "
    "watched, {watched_s:g} s; what limits it later, if anything, is not known.",
    "leaves the limit": "Held still and pushed, the device went beyond its limit.",
    "failed": "The loop failed as its run was repeated, or while it was watched after it: {detail}",
    "leaves the wall": "Held still, the hand does not keep the device at the wall.",
    "rests off the wall": "After a push of {push_N:.3g} N it came to rest off the wall.",
    "larger rests": "After a push of {push_N:.3g} N it came to rest, but after one of a tenth of that it swings on, by "
    "{width} peak to peak at {frequency_Hz:.3g} Hz: either may happen, depending on how it is touched.",
    "smaller rests": "After a push of {push_N:.3g} N it swings on, by {width} peak to peak at {frequency_Hz:.3g} Hz, "
    "but after one of a tenth of that it came to rest: either may happen, depending on how it is touched.",
    "too few": "It still moves, by {width} peak to peak in half of {watched_s:g} s: too slowly to tell how "
    "it will end; {run} might show it.",
    "too slow": "Of its swings of {width} peak to peak at {frequency_Hz:.3g} Hz, the steadier changes by "
    "{rate_1_s:.2g} +- {error_1_s:.2g} 1/s: too slowly, or too differently from the other, to be judged within "
    "{watched_s:g} s; {run} might show it.",
}
# What may tell more of a loop that was watched for less than ``haploop judge`` watches.
JUDGED_S, JUDGE = 64.0, "haploop judge, which watches for up to 64 s,"
DECAYING = ", and still decaying by {0:.3g} +- {1:.2g} 1/s"
# What is said in addition after a blow, and about the loop without its friction.
AFTER_BLOW = {
    "rests": " It also did so after blows of {blow_N:.3g} N for 0.05 s, into the wall and off it.",
    "rests off the wall": " It also did so after blows of {blow_N:.3g} N for 0.05 s, into the wall and off it, "
    "but where the blow had left it: the hand does not bring it back.",
    "swings on": " After a harder blow, of {blow_N:.3g} N, it swings on: either may happen, depending on how it is "
    "touched.",
    "undecided": " Whether it also does so after a harder blow, of {blow_N:.3g} N, could not be determined.",
}
SWINGS_ON, GROWS_ON = "it swings on, by {} peak to peak", "its swing grows"
LEFT_ALONE = {
    "rests": "",
    "rests off the wall": "",
    "swings on": " Not pushed, from where its run ended, {}: either may happen, depending on how it is touched.",
    "undecided": " Whether it also does so if it is not pushed, from where its run ended, could not be determined.",
}
AT_HARDEST = {
    "rests": " It also does so at the hand's hardest hold, {hardest_N:.3g} N.",
    "swings on": " At the hand's hardest hold, {hardest_N:.3g} N, it swings on.",
    "undecided": " Whether it also does so at the hand's hardest hold, {hardest_N:.3g} N, could not be determined.",
}
DEEPER = {
    "rests": " It also does so held harder by parts of a count, or of a step of the force.",
    "swings on": " Held {deeper_N:.2g} N harder, by a part of a count or of a step of the force, it swings on.",
    "undecided": " Whether it also does so held {deeper_N:.2g} N harder, by a part of a count or of a step of force, "
    "could not be determined.",
}
LASTS, GROWS = "a swing of {} peak to peak would last", "its swing would grow"
FRICTIONLESS = {
    "rests": " Held like this, it would also rest without its friction.",
    "swings on": " Only friction holds it: without it, {}.",
    "swings on a part of a count deeper": " Only friction holds it: without it, and held a part of an encoder's count "
    "deeper, {}.",
    "undecided": " Whether it would rest without its friction could not be determined.",
}
