/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The older component's INI files name a device by its serial number; the
 * daemon's shared memory names it as pokeysd.conf does. So each device's state
 * is read once, as any monitor would, and says its number; nothing of that is
 * a commander, who is taken only of the right one.
 */
#include "halbridge/find_serial.h"
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include "shm/runtime.h"

/* The device's serial number, 0 = not known. */
static uint32_t serial_of(const char *runtime, const char *device)
{
	/* too large for a thread's stack; one thread looks */
	static struct pokeys_state state;
	pokeys_client *client;
	uint32_t serial = 0;

	if (pokeys_client_open(&client, runtime, device, "pokeys", 0))
		return 0;
	if (pokeys_client_poll(client) == POKEYS_CLIENT_ATTACHED &&
	    !pokeys_client_read(client, &state))
		serial = state.identity.serial;
	pokeys_client_close(client);
	return serial;
}

int find_serial(const char *runtime, uint32_t serial, char name[POKEYS_SHM_NAME_MAX], char *all,
		size_t size)
{
	char names[SHM_DEVICES_MAX][POKEYS_SHM_NAME_MAX];
	int count = pokeys_shm_devices(runtime, names, SHM_DEVICES_MAX);
	size_t at = 0;

	all[0] = '\0';
	for (int i = 0; i < count && i < SHM_DEVICES_MAX; i++) {
		uint32_t has = serial_of(runtime, names[i]);

		if (has == serial) {
			memcpy(name, names[i], POKEYS_SHM_NAME_MAX);
			return 1;
		}
		if (at < size)
			at += (size_t)snprintf(all + at, size - at, "%s%s %u", i ? ", " : "",
					       names[i], has);
	}
	return count < 0 ? count : 0;
}
