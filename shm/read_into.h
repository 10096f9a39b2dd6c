/* SPDX-License-Identifier: MIT */
/*
 * A state image for a thread that counts instructions: it is copied once, not into a buffer of its
 * own first, and so the caller has to keep the image of before in another one.
 */
#ifndef SHM_READ_INTO_H
#define SHM_READ_INTO_H

#include <pokeys/shm.h>

/* As pokeys_client_read(), but *out is anything unless 0 is returned. Realtime, lock-free. */
int client_read_into(pokeys_client *client, struct pokeys_state *out);

#endif
