"""Many times: randomised trials x controllers, in parallel, kept in a store that can be resumed, with statistics."""
