/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The user whom the service runs as. */
#ifndef CONTROL_SERVICE_H
#define CONTROL_SERVICE_H

#include <stddef.h>

#define SERVICE_USER "pokeys"		/* as systemd's unit and sysusers have it */

/*
 * Root becomes the service's user, for good: what is judged then is what the service will
 * find. Whom else it is judged for goes into `note` ("; judged for user ..."), which is
 * empty for the service's user. Cold, before any thread.
 */
void service_become(char *note, size_t size);

#endif
